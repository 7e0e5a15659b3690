from legs.common import feet, now


def on_foot(node, message, side):
    feet(node)[side] = message.data, now(node)


def balance(node):
    heights = [h for h, at in feet(node).values() if now(node) - at < 1]
    return min(heights) if len(heights) == 2 else None
