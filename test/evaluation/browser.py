# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A headless Chromium, driven through its debugging pipe: no driver, no port, no package.

Messages are JSON, each ended by a zero byte, written to the browser's descriptor 3 and read
from its 4.
"""

import base64
import io
import json
import os
import select
import shutil
import subprocess
import time

import numpy as np
from PIL import Image

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
TIMEOUT_S = 60.0


def find():
    """Return the path of an installed Chromium, None without one."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """Use as a context manager; `errors` collects what the page complains of."""

    def __init__(self, folder, size=(1100, 900)):
        self._number, self._events = 0, []
        self.requests, self.errors = [], []
        to_read, self._out = os.pipe()
        self._in, to_write = os.pipe()

        def descriptors():
            os.dup2(to_read, 3, inheritable=True)
            os.dup2(to_write, 4, inheritable=True)

        # Descriptors below 5 would be overwritten by each other.
        to_read, to_write = (os.dup(fd) if fd > 4 else _above(fd) for fd in (to_read, to_write))
        self.process = subprocess.Popen(
            [find(), '--headless=new', '--no-sandbox', '--remote-debugging-pipe',
             '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-first-run',
             '--disable-dev-shm-usage', '--disable-background-networking',
             f'--window-size={size[0]},{size[1]}', f'--user-data-dir={folder}', 'about:blank'],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            preexec_fn=descriptors, close_fds=False)
        os.close(to_read), os.close(to_write)
        self._rest = b''
        target = self.call('Target.createTarget', url='about:blank')['targetId']
        self._session = None
        self._session = self.call('Target.attachToTarget', targetId=target,
                                  flatten=True)['sessionId']
        for domain in ('Page', 'Runtime', 'Network', 'Log'):
            self.call(f'{domain}.enable')
        self.call('Emulation.setDeviceMetricsOverride', width=size[0], height=size[1],
                  deviceScaleFactor=1, mobile=False)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        os.close(self._out), os.close(self._in)

    def call(self, method, **params):
        """Return the result of a command."""
        self._number += 1
        message = {'id': self._number, 'method': method, 'params': params}
        if getattr(self, '_session', None):
            message['sessionId'] = self._session
        os.write(self._out, json.dumps(message).encode() + b'\0')
        while True:
            answer = self._read()
            if answer.get('id') == self._number:
                assert 'error' not in answer, (method, answer['error'])
                return answer['result']

    def _read(self):
        end = time.monotonic() + TIMEOUT_S
        while b'\0' not in self._rest:
            assert select.select([self._in], [], [], max(0, end - time.monotonic()))[0], (
                'the browser does not answer')
            self._rest += os.read(self._in, 2 ** 20)
        text, _, self._rest = self._rest.partition(b'\0')
        message = json.loads(text)
        kind, params = message.get('method'), message.get('params')
        if kind == 'Network.requestWillBeSent':
            self.requests.append(params['request']['url'])
        elif kind == 'Runtime.exceptionThrown':
            self.errors.append(params['exceptionDetails'])
        elif kind == 'Log.entryAdded' and params['entry']['level'] == 'error':
            self.errors.append(params['entry'])
        elif kind == 'Runtime.consoleAPICalled' and params['type'] == 'error':
            self.errors.append(params)
        return message

    def open(self, path):
        """Load a file and wait until it stands."""
        self.call('Page.navigate', url=path.resolve().as_uri())
        self.until('document.readyState === "complete" && location.protocol === "file:"')

    def evaluate(self, expression):
        """Return the value of a JavaScript expression."""
        result = self.call('Runtime.evaluate', expression=expression, returnByValue=True,
                           awaitPromise=True)
        assert 'exceptionDetails' not in result, result['exceptionDetails']
        return result['result'].get('value')

    def until(self, expression):
        """Wait for an expression to hold."""
        end = time.monotonic() + TIMEOUT_S
        while not self.evaluate(expression):
            assert time.monotonic() < end, expression
            time.sleep(0.05)

    def mouse(self, kind, x, y, **more):
        """Press, release or move the mouse at a place of the window, CSS pixels."""
        self.call('Input.dispatchMouseEvent', type=f'mouse{kind}', x=x, y=y, **more)

    def click(self, x, y):
        """Click with the left button."""
        self.mouse('Pressed', x, y, button='left', clickCount=1)
        self.mouse('Released', x, y, button='left', clickCount=1)

    def drag(self, start, end):
        """Drag with the left button."""
        self.mouse('Pressed', *start, button='left', clickCount=1)
        for share in (0.5, 1.0):
            self.mouse('Moved', *(a + share * (b - a) for a, b in zip(start, end)),
                       button='left', buttons=1)
        self.mouse('Released', *end, button='left', clickCount=1)

    def picture(self, expression):
        """Return (h, w, 3) uint8 of the canvas that an expression names."""
        uri = self.evaluate(f'({expression}).toDataURL("image/png")')
        image = Image.open(io.BytesIO(base64.b64decode(uri.split(',')[1])))
        return np.asarray(image.convert('RGB'))


def _above(fd):
    """Return a copy of a descriptor above those that the browser wants."""
    low, copies = os.dup(fd), []
    while low <= 4:
        copies.append(low)
        low = os.dup(fd)
    for copy in copies:
        os.close(copy)
    return low
