#!/usr/bin/python3
"""Makes docs/pictures/replay_page.png and report_page.png anew, in Debian's chromium: the page of config/accident.yaml, and the
report of config/studies/paper_sensitivity.yaml. And notebook.png: the last picture that docs/notebooks/first_run.ipynb holds.

  page_pictures.py path/to/derail [FOLDER]
"""

import base64
import json
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.realpath(__file__))
sys.path.insert(0, os.path.join(HERE, '..', 'test', 'scripts'))

from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402

from browser_testing import open_browser, open_page, wait  # noqa: E402


def last_picture(notebook):
    with open(notebook, encoding='utf-8') as file:
        cells = json.load(file)['cells']
    pictures = [o['data']['image/png'] for cell in cells for o in cell.get('outputs', []) if 'image/png' in o.get('data', {})]
    return base64.b64decode(pictures[-1])


def main(program, folder=os.path.join(HERE, '..', 'docs', 'pictures')):
    with open(os.path.join(folder, 'notebook.png'), 'wb') as file:
        file.write(last_picture(os.path.join(HERE, '..', 'docs', 'notebooks', 'first_run.ipynb')))
    with tempfile.TemporaryDirectory() as work:
        page = os.path.join(work, 'replay.html')
        scenario = os.path.join(HERE, '..', 'config', 'accident.yaml')
        subprocess.run([program, 'run', scenario, '--html', page, '--quiet'], check=True)
        study, results = os.path.join(HERE, '..', 'config', 'studies', 'paper_sensitivity.yaml'), os.path.join(work, 'results')
        subprocess.run([program, 'study', study, '--out', results, '--quiet'], check=True)
        subprocess.run([program, 'report', results, '--quiet'], check=True)
        browser = open_browser(os.path.join(work, 'profile'), 1280, 1020)
        try:
            open_page(browser, page)
            wait(browser, 'return replay.asleep')
            browser.save_screenshot(os.path.join(folder, 'replay_page.png'))
            open_page(browser, os.path.join(results, 'report.html'))
            chart = browser.find_element('css selector', 'figure.chart')
            browser.execute_script('arguments[0].scrollIntoView()', chart)
            ActionChains(browser).move_to_element(chart.find_elements('css selector', '.said .dot')[4]).perform()
            browser.save_screenshot(os.path.join(folder, 'report_page.png'))
        finally:
            browser.quit()


if __name__ == '__main__':
    main(*sys.argv[1:])
