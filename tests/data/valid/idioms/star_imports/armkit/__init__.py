from .kinematics import *
from .callbacks import prepare

__all__ = ['prepare', 'forward', 'LINKS']
