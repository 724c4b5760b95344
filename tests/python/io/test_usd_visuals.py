"""What scenes of USD by others show: shapes without physics, with colours, beside hidden colliders."""

import amontons
import numpy as np
import pytest
from amontons import shapes
from amontons.model.visuals import TriangleMesh

pytest.importorskip("pxr", reason="needs usd-core")

ROBOT = """#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "arm" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])
{
    double3 xformOp:translate = (0, 0, 100)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "box" (prepend apiSchemas = ["PhysicsCollisionAPI"])
    {
        double size = 20
        uniform token purpose = "guide"
    }
    def Sphere "look" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double radius = 15
        rel material:binding = </Looks/red>
    }
    def Mesh "shell"
    {
        point3f[] points = [(0, 0, 0), (10, 0, 0), (0, 10, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        color3f[] primvars:displayColor = [(0, 1, 0)]
        double3 xformOp:translate = (0, 0, 20)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Sphere "off"
    {
        token visibility = "invisible"
    }
    def Mesh "broken"
    {
        int[] faceVertexCounts = [3]
    }
}
def Cube "table"
{
    double size = 100
}
def Scope "Looks"
{
    def Material "red"
    {
        token outputs:surface.connect = </Looks/red/shader.outputs:surface>
        def Shader "shader"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (1, 0, 0)
            float inputs:opacity = 0.5
            token outputs:surface
        }
    }
}
"""


# Breaks when what is rendered is not shown, in metres and its colours, or what is hidden is, or a broken mesh
# refuses the model.
def test_shown_parts(tmp_path):
    path = tmp_path / "robot.usda"
    path.write_text(ROBOT)
    model = amontons.load_model(path)
    look, shell, table = model.visuals
    assert (look.name, look.body, look.shape, look.colour) == ("look", 0, shapes.Sphere(0.15), (1, 0, 0, 0.5))
    assert isinstance(shell.shape, TriangleMesh)
    assert shell.colour == (0, 1, 0, 1)
    np.testing.assert_allclose(shell.frame.position, (0, 0, 0.2), atol=1e-12)
    np.testing.assert_allclose(shell.shape.vertices[1], (0.1, 0, 0), atol=1e-7)
    assert (table.body, table.shape, table.colour) == (-1, shapes.Box((0.5, 0.5, 0.5)), None)
    assert [geom.name for geom in model.geoms] == ["box"]
    assert model.unread == ()


# Breaks when colliders that are all there is to see become visuals beside themselves.
def test_colliders_alone(tmp_path):
    path = tmp_path / "robot.usda"
    path.write_text(
        '#usda 1.0\n(metersPerUnit = 1)\ndef Sphere "ball" (prepend apiSchemas = ["PhysicsRigidBodyAPI", '
        '"PhysicsCollisionAPI"])\n{\ndouble radius = 0.1\n}\n'
    )
    assert amontons.load_model(path).visuals == ()


# Breaks when what other programs see of a file that amontons wrote is another look.
def test_written_visuals_by_the_schema_alone(tmp_path):
    from pxr import Usd

    builder = amontons.ModelBuilder()
    builder.add_body("cube", shape=shapes.Box((0.1, 0.1, 0.1)), density=1000, position=(0, 0, 1))
    wedge = TriangleMesh([(0, 0, 0), (0.2, 0, 0), (0, 0.2, 0)], [(0, 1, 2)])
    builder.add_visual("cube", wedge, position=(0, 0, 0.1), colour=(0.75, 0.25, 0.5, 1))
    builder.add_visual("cube", shapes.Cylinder(0.1, 0.3), position=(0.1, 0, 0))
    model = builder.build()
    amontons.write_model(model, tmp_path / "cube.usda")
    stage = Usd.Stage.Open(str(tmp_path / "cube.usda"))
    for prim in stage.Traverse():
        for found in prim.GetAuthoredProperties():
            if found.GetName().startswith("amontons:"):
                prim.RemoveProperty(found.GetName())
    stage.Export(str(tmp_path / "plain.usda"))
    plain = amontons.load_model(tmp_path / "plain.usda")
    assert len(plain.visuals) == len(model.visuals)
    for one, other in zip(sorted(map(key, model.visuals)), sorted(map(key, plain.visuals)), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


def key(visual):
    """Body, colour and place."""
    colour = visual.colour or (-1, -1, -1, -1)
    return tuple(round(float(x), 6) for x in (visual.body, *colour, *visual.frame.position))
