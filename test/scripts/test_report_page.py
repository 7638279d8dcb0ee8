#!/usr/bin/python3
"""derail report in a real browser: tables that sort, charts that say their numbers, text that stays text, print, phones.

  test_report_page.py path/to/derail
"""

import base64
import csv
import os
import subprocess
import tempfile

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from browser_testing import PageTest, complaints, open_browser, open_page
from plot_testing import KIP, PlotTest, run_tests

HOSTILE = """</script><b id=evil>bold</b><img src=x onerror=alert(1)> & 'q' ${1} {{ 7*7 }}"""
STUDY = """
title: "%s"
scenario: scenario.yaml
plan: one_at_a_time
factors:
  - {key: initial.speed, label: "<b>speed</b>", values: [10 mph, 30 mph, 9 mph]}
replicates: 5
perturbation: {spacing: 30 mm}
outcomes: [coupler_force_peak, stop_time]
""" % HOSTILE
ENSEMBLE = """
title: ensemble
scenario: scenario.yaml
factors: []
replicates: 12
perturbation: {spacing: 30 mm}
outcomes: [coupler_force_peak]
"""
WIDE = """
title: wide
scenario: scenario.yaml
plan: one_at_a_time
factors:
  - {key: initial.speed, label: speed of the train when it derails, values: [10 mph, 30 mph]}
replicates: 3
perturbation: {spacing: 30 mm}
outcomes: [cars_past_pod, cars_off_track, cars_derailed, closing_speed_max, relative_speed_max, coupler_force_peak, pile_up_length,
  pile_up_width, pile_up_area, stop_time]
"""
SVG = '<svg xmlns="http://www.w3.org/2000/svg"><title>Force &amp; &lt;i&gt;</title><rect width="9" height="9"/></svg>'


class ReportPageTest(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.results, cls.ensemble = cls.path('results'), cls.path('ensemble')
        cls.derail('study', cls.path('study.yaml', STUDY), '--out', cls.results)
        cls.derail('study', cls.path('ensemble.yaml', ENSEMBLE), '--out', cls.ensemble)
        os.mkdir(cls.path('results/pictures'))
        cls.path('results/pictures/tornado_coupler_force_peak.svg', SVG)
        cls.path('results/pictures/tornado_coupler_force_peak.png', 'not this one: there is an SVG')
        cls.path('results/pictures/broken.svg', '<svg')
        for folder in (cls.results, cls.ensemble):
            cls.derail('report', folder)
        cls.page = os.path.join(cls.results, 'report.html')

    def is_meant(self, complaint):
        # The picture that is none shows as a broken one; a page may hold what it was given.
        return 'data:image' in complaint

    def column(self, k):
        return [r.text for r in self.browser.find_elements(By.CSS_SELECTOR, f'#outcomes tbody td:nth-child({k})')]

    def show(self, selector):
        element = self.browser.find_element(By.CSS_SELECTOR, selector)
        self.browser.execute_script('arguments[0].scrollIntoView({block: "center"})', element)
        return element

    def test_tables_sort_by_numbers_not_by_their_digits(self):
        head = self.show('#outcomes thead th:nth-child(2)')
        self.assertEqual(self.column(2), ['', '10 mph', '30 mph', '9 mph'])
        head.click()
        self.assertEqual(self.column(2), ['9 mph', '10 mph', '30 mph', ''])
        self.assertEqual(head.get_attribute('aria-sort'), 'ascending')
        head.click()
        self.assertEqual([t for t in self.column(2) if t], ['30 mph', '10 mph', '9 mph'])
        other = self.show('#outcomes thead th:nth-child(6)')
        other.send_keys(Keys.ENTER)
        medians = [float(t.split()[0]) for t in self.column(6)]
        self.assertEqual(medians, sorted(medians))
        self.assertIsNone(head.get_attribute('aria-sort'))

    def test_charts_say_the_numbers_under_the_pointer(self):
        with open(os.path.join(self.results, 'summary.csv'), encoding='utf-8', newline='') as file:
            rows = [r for r in csv.DictReader(file) if r['outcome'] == 'coupler_force_peak']
        chart = self.show('figure[data-outcome=coupler_force_peak]')
        readout, shown = chart.find_element(By.CLASS_NAME, 'readout'), chart.find_elements(By.CLASS_NAME, 'said')
        self.assertEqual(len(shown), len(rows))
        for element, row in zip(shown, rows):
            ActionChains(self.browser).move_to_element(element.find_element(By.CLASS_NAME, 'dot')).perform()
            self.assertIn(f"median {float(row['median']) / KIP:.4g} kip", readout.text)
            self.assertIn(f"{float(row['low']) / KIP:.4g} kip to {float(row['high']) / KIP:.4g}", readout.text)
        # Dots lie on the axis where their numbers are.
        ticks = [(float(t.text), t.rect['x'] + t.rect['width'] / 2) for t in chart.find_elements(By.CSS_SELECTOR, '.foot text')]
        (a, xa), (b, xb) = ticks[0], ticks[-1]
        for element, row in zip(shown, rows):
            dot = element.find_element(By.CLASS_NAME, 'dot').rect
            value = a + (dot['x'] + dot['width'] / 2 - xa) / (xb - xa) * (b - a)
            self.assertAlmostEqual(value, float(row['median']) / KIP, delta=0.01 * (b - a))

    def test_charts_say_them_to_the_keyboard(self):
        chart = self.show('figure[data-outcome=stop_time]')
        chart.send_keys(Keys.ARROW_DOWN, Keys.ARROW_DOWN)
        self.assertIn('speed', chart.find_element(By.CLASS_NAME, 'readout').text)
        chart.send_keys(Keys.ARROW_UP)
        self.assertTrue(chart.find_element(By.CLASS_NAME, 'readout').text.startswith('base'))

    def test_an_ensemble_has_histograms(self):
        open_page(self.browser, os.path.join(self.ensemble, 'report.html'))
        bars = self.browser.find_elements(By.CSS_SELECTOR, 'figure[data-outcome=coupler_force_peak] g.said')
        counts = [int(b.get_attribute('data-says').split(': ')[1].split()[0]) for b in bars]
        self.assertEqual(sum(counts), 12)
        heights = [b.find_element(By.CLASS_NAME, 'bar').rect['height'] for b in bars]
        most = max(range(len(bars)), key=counts.__getitem__)
        for count, height in zip(counts, heights):
            self.assertAlmostEqual(height, heights[most] * count / counts[most], delta=2)
        self.show('figure[data-outcome=coupler_force_peak]')
        ActionChains(self.browser).move_to_element(bars[most]).perform()
        self.assertIn(f'{counts[most]} of 12 runs', self.browser.find_element(By.CLASS_NAME, 'readout').text)

    def test_what_users_type_stays_text(self):
        self.assertEqual(self.browser.find_element(By.TAG_NAME, 'h1').text, HOSTILE)
        self.assertEqual(self.browser.title, HOSTILE)
        self.assertEqual(self.browser.find_elements(By.ID, 'evil'), [])
        self.assertIn('<b>speed</b>', self.column(1))
        with open(self.page, encoding='utf-8') as file:
            text = file.read()
        self.assertEqual(text.count('<script'), text.count('</script>'))
        self.assertNotIn('<b>speed', text)

    def test_needs_no_other_file_and_no_network(self):
        loads = self.js('performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:"))')
        self.assertEqual(loads, [])

    def test_pictures_stand_whole_with_their_captions(self):
        images = self.browser.find_elements(By.TAG_NAME, 'img')
        captions = [i.get_attribute('alt') for i in images]
        self.assertEqual(captions, ['broken', 'Force & <i>'], 'those of no outcome first; an SVG before its PNG')
        data = images[1].get_attribute('src').split(',')[1]
        self.assertEqual(base64.b64decode(data).decode(), SVG)
        groups = [h.text for h in self.browser.find_elements(By.TAG_NAME, 'h3')]
        self.assertEqual(groups, ['peak coupler force'])
        open_page(self.browser, os.path.join(self.ensemble, 'report.html'))
        self.assertIn(f'rosrun train_derail plot_study.py {self.ensemble}', self.browser.find_element(By.TAG_NAME, 'body').text)

    def test_a_report_is_replaced_and_no_other_file(self):
        self.derail('report', self.results)
        with open(self.path('own.html'), 'w', encoding='utf-8') as file:
            file.write('<!DOCTYPE html><p>mine</p>')
        said = subprocess.run([self.program, 'report', self.results, '--out', self.path('own.html')], capture_output=True,
                              text=True, check=False)
        self.assertEqual((said.returncode, '--force' in said.stderr), (1, True), said.stderr)

    def test_fits_a_phone_and_paper(self):
        for width in (390, 1280):
            self.browser.execute_cdp_cmd('Emulation.setDeviceMetricsOverride',
                                         {'width': width, 'height': 844, 'deviceScaleFactor': 2, 'mobile': width < 500})
            open_page(self.browser, self.page)
            self.assertLessEqual(self.js('document.documentElement.scrollWidth'), width)
            self.assertGreater(self.browser.find_element(By.CSS_SELECTOR, '.row.said svg').rect['width'], 250)
        self.browser.execute_cdp_cmd('Emulation.clearDeviceMetricsOverride', {})
        printed = base64.b64decode(self.browser.execute_cdp_cmd('Page.printToPDF', {'printBackground': False})['data'])
        self.assertTrue(printed.startswith(b'%PDF'))

    def test_a_wide_table_fits_on_paper(self):
        """Of ten outcomes: on the screen it scrolls, on paper what does not fit is lost."""
        wide = self.path('wide')
        self.derail('study', self.path('wide.yaml', WIDE), '--out', wide)
        self.derail('report', wide)
        open_page(self.browser, os.path.join(wide, 'report.html'))
        paper = {'width': 717, 'height': 1000, 'deviceScaleFactor': 1, 'mobile': False}  # A4, less its margins
        self.browser.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', paper)
        self.browser.execute_cdp_cmd('Emulation.setEmulatedMedia', {'media': 'print'})
        try:
            table = self.browser.find_element(By.ID, 'outcomes')
            self.assertEqual(len(table.find_elements(By.TAG_NAME, 'th')), 15)
            self.assertLessEqual(self.js('document.documentElement.scrollWidth'), 717)
            self.assertLessEqual(table.rect['x'] + table.rect['width'], 717)
            size = float(self.browser.find_element(By.CSS_SELECTOR, '#outcomes td').value_of_css_property('font-size')[:-2])
            self.assertGreater(size, 5.0, 'large enough to read')
            ends = [t.rect['x'] + t.rect['width'] for t in self.browser.find_elements(By.CSS_SELECTOR, '.foot text')]
            self.assertLessEqual(max(ends), 717, 'numbers at the ends of axes')
        finally:
            self.browser.execute_cdp_cmd('Emulation.setEmulatedMedia', {'media': ''})
            self.browser.execute_cdp_cmd('Emulation.clearDeviceMetricsOverride', {})

    def test_says_what_is_missing(self):
        """Without jinja2: the name of the package, and no half page."""
        hidden = self.path('hidden')
        os.makedirs(os.path.join(hidden, 'jinja2'), exist_ok=True)
        with open(os.path.join(hidden, 'jinja2', '__init__.py'), 'w', encoding='utf-8') as file:
            file.write("raise ImportError('No module named jinja2')\n")
        said = subprocess.run([self.program, 'report', self.results, '--out', self.path('none.html')], capture_output=True,
                              text=True, check=False, env=dict(os.environ, PYTHONPATH=hidden))
        self.assertEqual(said.returncode, 1)
        self.assertIn('python3-jinja2', said.stderr)
        self.assertFalse(os.path.exists(self.path('none.html')))


class MembersPageTest(PlotTest):
    """derail replay of a study: three runs side by side."""

    def test_three_scenes_say_how_they_were_chosen(self):
        results, page = self.path('results'), self.path('members.html')
        self.derail('study', self.path('ensemble.yaml', ENSEMBLE), '--out', results)
        self.derail('replay', results, '--html', page)
        with open(os.path.join(results, 'runs.csv'), encoding='utf-8', newline='') as file:
            rows = sorted(csv.DictReader(file), key=lambda r: float(r['coupler_force_peak']))
        with tempfile.TemporaryDirectory() as profile:
            browser = open_browser(profile)
            try:
                open_page(browser, page)
                self.assertEqual(browser.execute_script('return replay.scenes.length'), 3)
                captions = [f.text for f in browser.find_elements(By.CSS_SELECTOR, '.scene figcaption')]
                for caption, name, rank in zip(captions, ('small (5 %)', 'median', 'large (95 %)'), (1, 6, 10)):
                    peak = float(rows[rank]['coupler_force_peak']) / KIP
                    self.assertEqual(caption, f"{name}: {peak:.4g} kip, run {rows[rank]['run']}")
                text = browser.find_element(By.TAG_NAME, 'header').text
                self.assertIn('Out of 12 runs: those nearest to the 5 %, 50 % and 95 % quantile of "peak coupler force"', text)
                self.assertEqual(complaints(browser), [])
            finally:
                browser.quit()


if __name__ == '__main__':
    run_tests()
