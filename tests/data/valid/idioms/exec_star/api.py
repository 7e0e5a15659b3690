from generated import *
