def make(step):
    def count(node):
        node.own_state['value'] = value = node.own_state.get('value', 0) + step
        return value
    return count
