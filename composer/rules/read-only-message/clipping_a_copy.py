from copy import deepcopy


def clip(node, scan):
    clipped = deepcopy(scan)
    clipped.range_max = min(scan.range_max, 10.0)
    return clipped
