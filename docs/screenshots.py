"""Take the pictures of the page that the docs show, with Chromium: `make screenshots`."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from selenium import webdriver

_ROOT = Path(__file__).parent.parent
_TARGET = _ROOT / 'docs' / 'images'
# The system, what of it is chosen, and whether it runs.
_EXAMPLES = {
    'robot': ('node:/robot/governor', True),
    'greeter': ('node:/greeter_publisher', True),
    'monitor': ('topic:/diagnostics', True),
    'two_arms': ('', False),
    'patrol': ('', False),
    'cell': ('', False),
}
_SETTLE_SEC = 6.0


@contextmanager
def _running(*words: str) -> Iterator[subprocess.Popen[str]]:
    environment = {**os.environ, 'ROS_DOMAIN_ID': '87', 'ROS_LOCALHOST_ONLY': '1'}
    process = subprocess.Popen(  # noqa: S603 - Composer itself
        [sys.executable, '-m', 'composer', *words],
        cwd=_ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _take(browser: webdriver.Chrome, name: str, chosen: str, *, runs: bool) -> None:
    path = f'configs/{name}.yaml'
    words = ['up', path, '--page'] if runs else ['page', path, '--no-browser']
    with _running(*words) as process:
        lines = process.stdout or ()
        address = next(line.strip() for line in lines if 'token=' in line)
        browser.get(address)
        if chosen:
            browser.get(f'{address.partition("?")[0]}#{chosen}')
        time.sleep(_SETTLE_SEC if runs else 1.0)
        browser.save_screenshot(str(_TARGET / f'page_{name}.png'))


def main() -> None:
    """Take all of them."""
    _TARGET.mkdir(exist_ok=True)
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which('chromium') or ''
    for each in ('--headless=new', '--no-sandbox', '--disable-gpu', '--window-size=1440,900'):
        options.add_argument(each)
    service = webdriver.ChromeService(shutil.which('chromedriver'))
    with webdriver.Chrome(options=options, service=service) as browser:
        for name, (chosen, runs) in _EXAMPLES.items():
            _take(browser, name, chosen, runs=runs)


if __name__ == '__main__':
    main()
