"""BlockCholesky against Eigen's sparse Cholesky on the body-space matrix of problem files.

    python benchmarks/block_cholesky.py FILE.hdf5 ... [--program build/python/benchmarks/block_cholesky]

The matrix is I + D' P^-1 D with six unknowns per body: the pattern of the matrix that the interior point
and the Newton method factor in every step. The values do not matter for the time. The program, which
`make bench` builds, prints the table.
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import amontons
import numpy as np
import scipy.io
import scipy.sparse as sp

ROOT = Path(__file__).resolve().parent.parent


def body_space_matrix(path: Path) -> sp.csr_array:
    A = amontons.vi.read_problem(path).A
    if isinstance(A, amontons.vi.Contacts):
        A = A.stored()
    if not isinstance(A, amontons.vi.Factored):
        raise SystemExit(f"{path}: its A is not factored, so that there is no body space")
    D = A.jacobian()
    D = D[:, np.repeat(np.diff(sp.csc_array(D).indptr).reshape(-1, 6).any(axis=1), 6)]  # bodies without rows
    weights = sp.diags_array(1.0 / np.maximum(A.diagonal(), 1e-14 * A.diagonal().max()))
    return sp.csr_array(D.T @ weights @ D + sp.eye_array(D.shape[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--program", type=Path, default=ROOT / "build/python/benchmarks/block_cholesky")
    parser.add_argument("--repeats", type=int, default=20)
    arguments = parser.parse_args()
    for path in arguments.files:
        with tempfile.TemporaryDirectory() as folder:
            matrix = Path(folder) / "matrix.mtx"
            scipy.io.mmwrite(matrix, sp.tril(body_space_matrix(path)), symmetry="general", precision=17)
            print(path.name, flush=True)
            subprocess.run([arguments.program, matrix, str(arguments.repeats)], check=True)


if __name__ == "__main__":
    main()
