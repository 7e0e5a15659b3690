from __future__ import annotations

try:
    from ackermann_msgs.msg import AckermannDrive as Command
except ImportError:
    from geometry_msgs.msg import Twist as Command

try:
    import diagnostic_updater as updater
except ImportError:
    updater = None

Result = None
if updater is None:
    from std_msgs.msg import Float32 as Result
    from diagnostic_msgs.msg import DiagnosticStatus as Status
else:
    from std_msgs.msg import Float64 as Result
    Status = updater.DiagnosticStatusWrapper


def make(node) -> Command:
    command = Command()
    if hasattr(command, 'steering_angle'):
        command.steering_angle = 0.1
        command.speed = 1.0
    else:
        command.angular.z, command.linear.x = 0.1, 1.0
    return command


def on_cmd(node, command: Command) -> Result:
    speed = command.speed if 'speed' in command.get_fields_and_field_types() else command.linear.x
    return Result(data=speed)


def status(node) -> Status:
    stat = Status(name=node.name)
    try:
        stat.summary(Status.OK, 'ok')
    except AttributeError:
        stat.level, stat.message = Status.OK, 'ok'
    return stat
