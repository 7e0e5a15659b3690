def answer(node, message):
    return f'You said {message.data}'
