"""A browser without a window, for the tests of pages."""

import os
import shutil
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

DRIVER = '/usr/bin/chromedriver'


def open_browser(profile, width=1280, height=900):
    """Debian's chromium, drawing by software, for files only: nothing else is reached."""
    options = Options()
    options.binary_location = shutil.which('chromium')
    for argument in (
        '--headless=new',
        '--no-sandbox',
        '--disable-dev-shm-usage',
        '--use-gl=angle',
        '--use-angle=swiftshader',
        '--enable-unsafe-swiftshader',
        '--ignore-gpu-blocklist',
        '--host-resolver-rules=MAP * ~NOTFOUND',
        '--hide-scrollbars',
        f'--user-data-dir={profile}',
        f'--window-size={width},{height}',
    ):
        options.add_argument(argument)
    options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
    return webdriver.Chrome(service=Service(DRIVER), options=options)


def open_page(driver, path, seconds=120):
    """Opens a page of ours and waits until its script says that it is ready; returns how long that took [s]."""
    start = time.monotonic()
    driver.get('file://' + os.path.abspath(path))
    wait(driver, 'return document.documentElement.dataset.ready !== undefined', seconds)
    return time.monotonic() - start


def wait(driver, script, seconds=60):
    """Waits until a script of the page returns something true."""
    WebDriverWait(driver, seconds, poll_frequency=0.05).until(lambda d: d.execute_script(script))


def complaints(driver):
    """What the page has said on the console that is no mere remark."""
    return [e['message'] for e in driver.get_log('browser') if e['level'] in ('SEVERE', 'WARNING')
            and 'GL Driver Message' not in e['message']]
