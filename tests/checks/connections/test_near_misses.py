"""Names beside external processes that say nothing: slips are told, and right names never are.

The names and types are those of public robots: TurtleBot 4, Nav2, RealSense, UR, slam_toolbox.
"""

import random

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text

TOPICS = {
    'sensor_msgs/msg/Image': [
        *('camera/color/image_raw', 'camera/color/image_rect_raw', 'camera/depth/image_rect_raw'),
        *('camera/infra1/image_rect_raw', 'camera/infra2/image_rect_raw', 'left/image_raw'),
        *('right/image_raw', 'oakd/rgb/preview/image_raw', 'camera/aligned_depth/image_raw'),
    ],
    'sensor_msgs/msg/CameraInfo': [
        *('camera/color/camera_info', 'camera/depth/camera_info', 'camera/infra1/camera_info'),
        *('left/camera_info', 'right/camera_info'),
    ],
    'sensor_msgs/msg/LaserScan': ['scan', 'scan_filtered', 'scan_1', 'scan_2', 'front/scan'],
    'geometry_msgs/msg/Twist': [
        *('cmd_vel', 'cmd_vel_nav', 'cmd_vel_teleop', 'cmd_vel_smoothed', 'cmd_vel_unstamped'),
        'joy_vel',
    ],
    'geometry_msgs/msg/PoseStamped': ['goal_pose', 'goal_update', 'robot_pose', 'dock_pose'],
    'geometry_msgs/msg/PoseWithCovarianceStamped': ['initialpose', 'pose', 'amcl_pose'],
    'nav_msgs/msg/Path': [
        *('plan', 'local_plan', 'global_plan', 'plan_smoothed', 'transformed_global_plan'),
    ],
    'nav_msgs/msg/OccupancyGrid': [
        *('map', 'global_costmap/costmap', 'local_costmap/costmap', 'speed_mask', 'keepout_mask'),
    ],
    'nav_msgs/msg/Odometry': ['odom', 'odom_raw', 'odometry/filtered', 'odometry/global'],
    'sensor_msgs/msg/Imu': ['imu', 'imu/data', 'imu/data_raw', 'imu/data_rpy'],
    'sensor_msgs/msg/JointState': ['joint_states', 'arm_l/joint_states', 'arm_r/joint_states'],
    'std_msgs/msg/Float64MultiArray': [
        *('velocity_controller/commands', 'position_controller/commands', 'effort/commands'),
    ],
    'std_msgs/msg/String': ['robot_description', 'speech', 'event', 'behavior_tree_log'],
    'std_msgs/msg/Bool': ['stop', 'slip', 'enable', 'estop', 'is_docked', 'motor_l', 'motor_r'],
    'std_msgs/msg/Float32': ['speed_min', 'speed_max', 'vel_x', 'vel_y', 'angle_in', 'angle_out'],
}
SERVICES = {
    'std_srvs/srv/Empty': [
        *('reinitialize_global_localization', 'request_nomotion_update', 'clear_costmap'),
    ],
    'std_srvs/srv/Trigger': ['start_motor', 'stop_motor', 'io/power_on', 'io/power_off', 'dock'],
    'std_srvs/srv/SetBool': ['enable_left', 'enable_right', 'toggle_color', 'toggle_depth'],
}
NAMES = [(name, kind) for kind, names in TOPICS.items() for name in names]
SERVED = [(name, kind) for kind, names in SERVICES.items() for name in names]


def check(publishers, subscriptions, clients=(), servers=()):
    """Return what is said of a system with a node for each end, beside a program."""
    nodes = []
    for index, (name, kind) in enumerate(publishers):
        nodes.append(f'  pub{index}: {{publishers: {{p: {{type: {kind}, topic: {name}}}}}}}')
    for index, (name, kind) in enumerate(subscriptions):
        end = f'{{type: {kind}, topic: {name}, behaviour: "nodes:hear"}}'
        nodes.append(f'  sub{index}: {{subscriptions: {{s: {end}}}}}')
    for index, (name, kind) in enumerate(clients):
        nodes.append(
            f'  cli{index}: {{service_clients: {{c: {{type: {kind}, service: {name}}}}}}}'
        )
    for index, (name, kind) in enumerate(servers):
        end = f'{{type: {kind}, service: {name}, behaviour: "nodes:serve"}}'
        nodes.append(f'  srv{index}: {{services: {{s: {end}}}}}')
    text = '\n'.join(['version: 1', 'nodes:', *nodes, "processes: {driver: {command: ['true']}}"])
    findings = check_system(load_system_text(text), InterfaceCatalogue())
    rules = ('no-publisher', 'no-subscription', 'no-server', 'conflicting-types')
    return [each for each in findings if each.rule in rules]


@pytest.mark.parametrize('seed', range(10))
def test_right_names_are_never_doubted(seed):
    """Each end is elsewhere, or with ours, as it comes."""
    chance = random.Random(seed)
    published, heard = (chance.sample(NAMES, 30) for _ in range(2))
    called, served = (chance.sample(SERVED, 6) for _ in range(2))
    found = check(published, heard, called, served)
    assert not [f'{each.message} {each.help}' for each in found]


SLIPS = [
    *(
        ('cmd_vel', 'cmd_vell'),
        ('cmd_vel', 'cmd_vle'),
        ('cmd_vel', 'cmdvel'),
        ('cmd_vel', 'cdm_vel'),
    ),
    *(('cmd_vel', 'cmd_val'), ('cmd_vel', 'Cmd_vel'), ('scan', 'scann'), ('scan', 'sacn')),
    *(('odom', 'odm'), ('odom', 'odem'), ('map', 'mao'), ('imu/data', 'imu/date')),
    *(('imu/data_raw', 'imu/data_rwa'), ('joint_states', 'joint_state'), ('plan', 'plann')),
    *(('camera/color/camera_info', 'camera/colour/camera_info'), ('enable', 'enabel')),
    *(('velocity_controller/commands', 'velocity_controler/commands'), ('is_docked', 'is_doked')),
]


@pytest.mark.parametrize(('right', 'wrong'), SLIPS)
@pytest.mark.parametrize('is_published', [True, False])
def test_a_slip_is_told(right, wrong, is_published):
    """The other ends of all other names are elsewhere."""
    (kind,) = [kind for name, kind in NAMES if name == right]
    others = random.Random(right).sample([each for each in NAMES if each[0] != right], 10)
    ours, theirs = [(wrong, kind)], [(right, kind), *others]
    found = check(ours, theirs) if is_published else check(theirs, ours)
    assert any(f"'/{wrong}'" in each.message and f"'/{right}'" in each.help for each in found)


@pytest.mark.parametrize(
    ('right', 'wrong'),
    [
        *(('start_motor', 'strat_motor'), ('io/power_on', 'io/pwoer_on'), ('dock', 'dokc')),
        *(('enable_left', 'enable_lfet'), ('clear_costmap', 'clear_cost_map')),
    ],
)
def test_a_slip_in_a_service_is_told(right, wrong):
    (kind,) = [kind for name, kind in SERVED if name == right]
    others = [each for each in SERVED if each[0] != right]
    found = check((), (), [(wrong, kind)], [(right, kind), *others])
    assert [each.rule for each in found] == ['no-server']
    assert f"'/{right}'" in found[0].help
