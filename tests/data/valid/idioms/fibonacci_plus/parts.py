import time

from composer import GoalRejectedError


def accept(node, goal):
    if goal.order < 0:
        return False
    if goal.order > node.parameters.maximum:
        return f'at most {node.parameters.maximum}'
    return True


def execute(node, goal, pause):
    sequence = [0, 1]
    try:
        while len(sequence) <= goal.order:
            sequence.append(sum(sequence[-2:]))
            yield {'sequence': sequence}
            time.sleep(pause)
    finally:
        node.logger.info(f'{len(sequence)} numbers')
    return {'sequence': sequence[:goal.order]}


def send(node):
    for order in (5, 100, -1, 8):
        try:
            goal = node.send_goal('fibonacci', order)
        except GoalRejectedError as error:
            node.logger.info(f'{order}: {type(error).__name__}')
            yield
            continue
        last = None
        for last in goal.feedback:
            if len(last.sequence) > 7:
                goal.cancel()
        node.logger.info(f'{goal.status}: {last and list(last.sequence)}')
        yield


def on_feedback(node, feedback):
    node.publish('partial', {'data': feedback.sequence})


def on_result(node, result):
    node.state.results.append(list(result.sequence))
