def work(node, leads=False):
    if leads is None:
        return
    if leads:
        node.publish('order', 'forward')
    else:
        orders = node.state.orders
        node.publish('report', f'{len(orders)} orders')


def obey(node, message):
    node.state.orders.append(message.data)
