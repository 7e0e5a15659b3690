def clip(node, scan):
    scan.range_max = min(scan.range_max, 10.0)
    return scan
