"""What the C functions need of the system."""

import pytest

pytest.importorskip('rclpy')

from composer.executor.c_bindings import check_word_size
from composer.executor.descriptors import ExecutorError

pytestmark = pytest.mark.ros


def test_a_32_bit_system_is_refused():
    with pytest.raises(ExecutorError, match='needs a 64-bit system: this one has 32 bits'):
        check_word_size(4)
