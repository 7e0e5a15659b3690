import array

from sensor_msgs.msg import CameraInfo, Image


class Source:
    def __init__(self, width, height, channels):
        self.shape = width, height, channels
        self.shift = 0

    def read(self):
        width, height, channels = self.shape
        self.shift = (self.shift + 1) % 256
        return bytes((self.shift + i) % 256 for i in range(width * height * channels))


class Camera:
    def __init__(self, node):
        self.node = node
        parameters = node.parameters
        self.channels = 3 if parameters.encoding == 'rgb8' else 1
        self.source = Source(parameters.width, parameters.height, self.channels)
        self.info = None
        if parameters.device is not None:
            node.logger.info(f'reading {parameters.device}')

    def grab(self, node):
        image = Image(encoding=node.parameters.encoding, is_bigendian=0)
        image.header.frame_id = 'camera_optical'
        image.header.stamp = node.now().to_msg()
        image.width, image.height = node.parameters.width, node.parameters.height
        image.step = image.width * self.channels
        image.data = array.array('B', self.source.read())
        node.publish('image', image)
        node.publish('info', self.calibration(image.header))
        node.state.count += 1

    def calibration(self, header):
        info = self.info or CameraInfo(k=self.node.parameters.k)
        info.header = header
        return info

    def set_info(self, node, request):
        if request.camera_info.k[0] == 0.0:
            return {'success': False, 'status_message': 'not calibrated'}
        self.info = request.camera_info
        return {'success': True}
