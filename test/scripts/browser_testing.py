"""A browser without a window, for the tests of pages."""

import os
import shutil
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

from plot_testing import PlotTest

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


class PageTest(PlotTest):
    """Tests of one page, `page` of the class, opened anew for each. None may leave a complaint on the console."""

    page = ''

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.profile = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.profile.cleanup)
        cls.browser = open_browser(cls.profile.name)
        cls.addClassCleanup(cls.browser.quit)

    def setUp(self):
        self.browser.set_window_size(1280, 900)
        open_page(self.browser, self.page)

    def tearDown(self):
        self.assertEqual([c for c in complaints(self.browser) if not self.is_meant(c)], [])

    def is_meant(self, complaint):
        """Whether a test asks for this complaint."""
        return False

    def js(self, script, *arguments):
        return self.browser.execute_script('return ' + script, *arguments)
