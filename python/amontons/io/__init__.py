"""Files: problems, recordings and saved simulations, models.

`Problem.write`, `Simulation.save` and `Simulation.load` get their functions from here.
"""

from ..problem.problem import write_file
from ..simulation.saving import load_file, save_file
from .fmu import write_fmu as write_fmu
from .models import Lost as Lost
from .models import load_model as load_model
from .models import write_model as write_model
from .problems import HDF5 as HDF5
from .problems import SUFFIXES as SUFFIXES
from .problems import read_problem as read_problem
from .problems import write_problem as write_problem
from .recordings import load_simulation, save_simulation
from .recordings import read_recording as read_recording
from .recordings import record as record

write_file.supply(write_problem)
save_file.supply(save_simulation)
load_file.supply(load_simulation)
