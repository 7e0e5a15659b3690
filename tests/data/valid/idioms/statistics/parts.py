import collections
import statistics

import numpy as np
from std_msgs.msg import Float64MultiArray, MultiArrayDimension as Dim, MultiArrayLayout as Layout


def sample(node):
    return np.random.standard_normal().astype(np.float32) if hasattr(np.random.standard_normal(), 'astype') else np.float32(np.random.standard_normal())


def watch(node, message):
    window = node.state.__dict__.get('window')
    if window is None:
        window = node.state.window = collections.deque(maxlen=node.parameters.window)
    window.append(message.data)
    if len(window) < 5:
        return None
    mean, sigma = statistics.fmean(window), statistics.pstdev(window)
    return abs(message.data - mean) > 2 * sigma


def quantiles(node):
    window = getattr(node.state, 'window', ())
    if len(window) > 3:
        qs = np.percentile(window, [0, 25, 50, 75, 100])
        return Float64MultiArray(layout=Layout(dim=[Dim(label='q', size=len(qs), stride=1)]), data=qs.tolist())
