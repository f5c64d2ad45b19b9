# Types of the lazy names in __init__.py. A file of its own: imports for type checking there would make every module that asks for the
# version depend on the interface, which stands above all others.
from oio.api.calibrate import calibrate as calibrate
from oio.api.calibration import Calibration as Calibration
from oio.api.calibration_file import load_calibration as load_calibration
from oio.api.calibration_file import write_calibration as write_calibration
from oio.api.left_out import LeftOut as LeftOut
from oio.api.location import Location as Location
from oio.api.location import locate as locate
from oio.api.log_file import LogFile as LogFile
from oio.api.log_file import read_log as read_log
from oio.api.logged import Run as Run
from oio.api.logged import load_run as load_run
from oio.api.odometry import Odometry as Odometry
from oio.api.samples import JointPath as JointPath
from oio.api.samples import NosePath as NosePath
from oio.api.samples import Readings as Readings
from oio.api.setup import Setup as Setup
from oio.api.simulation import simulate as simulate
from oio.core.errors import BadInput as BadInput
from oio.core.errors import NotObservable as NotObservable

__version__: str
