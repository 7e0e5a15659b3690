import re
import statistics

from sensor_msgs import msg as sensors

SENSORS = {
    sensors.Temperature: (20.0, 0.1), sensors.FluidPressure: (101_325, 50), sensors.RelativeHumidity: (0.5, 0.0), sensors.Illuminance: (300.0, 5),
}


def snake(cls):
    return re.sub(r'(?<!^)(?=[A-Z])', '_', cls.__name__).lower()


def measure(node):
    for cls, (value, variance) in SENSORS.items():
        message = cls()
        field = snake(cls)
        message.header.frame_id = field
        setattr(message, field, float(value))
        message.variance = float(variance)
        node.publish(field, message)


def collect(node, message):
    value = getattr(message, snake(type(message)))
    node.state.__dict__.setdefault(message.header.frame_id, []).append(value)


def summary(node):
    values = {k: v for k, v in vars(node.state).items() if isinstance(v, list) and v}
    return ', '.join(f'{k}={statistics.mean(v):g}' for k, v in values.items()) or None
