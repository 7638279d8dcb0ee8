#!/usr/bin/python3
"""Makes docs/pictures/replay_page.png anew: the page of config/accident.yaml in Debian's chromium.

  page_pictures.py path/to/derail [FOLDER]
"""

import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.realpath(__file__))
sys.path.insert(0, os.path.join(HERE, '..', 'test', 'scripts'))

from browser_testing import open_browser, open_page, wait  # noqa: E402


def main(program, folder=os.path.join(HERE, '..', 'docs', 'pictures')):
    with tempfile.TemporaryDirectory() as work:
        page = os.path.join(work, 'replay.html')
        scenario = os.path.join(HERE, '..', 'config', 'accident.yaml')
        subprocess.run([program, 'run', scenario, '--html', page, '--quiet'], check=True)
        browser = open_browser(os.path.join(work, 'profile'), 1280, 1020)
        try:
            open_page(browser, page)
            wait(browser, 'return replay.asleep')
            browser.save_screenshot(os.path.join(folder, 'replay_page.png'))
        finally:
            browser.quit()


if __name__ == '__main__':
    main(*sys.argv[1:])
