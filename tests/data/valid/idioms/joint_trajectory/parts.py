import itertools

import numpy as np
from builtin_interfaces.msg import Duration as DurationMsg
from rclpy.duration import Duration
from rclpy.time import Time
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def publish_goals(node):
    goals = {name: getattr(node.parameters, name) for name in node.parameters.goal_names}
    seconds = node.parameters.wait_sec_between_publish
    for name, positions in itertools.cycle(goals.items()):
        node.logger.debug(f'Sending goal {name}')
        traj = JointTrajectory(joint_names=node.parameters.joints)
        traj.points.append(JointTrajectoryPoint(positions=positions, velocities=[0.0] * len(positions), time_from_start=DurationMsg(sec=seconds)))
        half = JointTrajectoryPoint()
        half.positions = [0.5 * p for p in positions]
        half.time_from_start = Duration(seconds=seconds / 2).to_msg()
        traj.points.insert(0, half)
        traj.header.stamp = node.now().to_msg()
        yield traj


def _seconds(duration):
    return Duration.from_msg(duration).nanoseconds / 1e9


def accept(node, traj):
    times = np.array([_seconds(p.time_from_start) for p in traj.points])
    if not np.all(np.diff(times, prepend=0.0) > 0):
        node.logger.error('times must increase')
        return
    start = getattr(node.state, 'position', np.zeros(len(traj.joint_names)))
    node.state.plan = dict(
        names=list(traj.joint_names), begin=Time.from_msg(traj.header.stamp, clock_type=node.now().clock_type),
        times=np.r_[0.0, times], knots=np.vstack([start, *(p.positions for p in traj.points)]),
    )


def interpolate(node):
    if not (plan := getattr(node.state, 'plan', None)):
        return None
    t = (node.now() - plan['begin']).nanoseconds / 1e9
    node.state.position = np.array([np.interp(t, plan['times'], k) for k in plan['knots'].T])
    return {'header': {'stamp': node.now()}, 'name': plan['names'], 'position': node.state.position}
