#!/usr/bin/python3
"""derail run --html in a real browser: what it shows against the CSV of the same run, clicks, keys, sizes, escaping.

  test_replay_page.py path/to/derail
"""

import csv
import math
import os
import tempfile

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from browser_testing import complaints, open_browser, open_page, wait
from plot_testing import PlotTest, run_tests

HOSTILE = """</script><b id=evil>bold</b><img src=x onerror=alert(1)> & "q" ${1} {{ 7*7 }}"""
SCENARIO = """
title: '%s'
consist:
  - {name: "x</script><i>", count: 2, length: 55 ft, weight: 286 kip, truck_spacing: 42 ft}
  - {name: hopper, count: 8, length: 55 ft, weight: 286 kip, truck_spacing: 42 ft}
coupler: {break_draft: 200 kip}
ground: {on_track_law: rails, off_track_law: by_slip}
contact: {law: elastic}
initial: {speed: 25 mph, yaw_rate: 0.3}
stop: {time_max: 12 s}
solver: {method: semi_implicit, fixed_step: 0.002}
""" % HOSTILE.replace("'", "''")


class ReplayPageTest(PlotTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.file, cls.page, cls.states = cls.path('hostile.yaml'), cls.path('replay.html'), cls.path('states.csv')
        with open(cls.file, 'w', encoding='utf-8') as file:
            file.write(SCENARIO)
        cls.derail('run', cls.file, '--html', cls.page, '--csv', cls.states, '--incidents', cls.path('incidents.csv'))
        with open(cls.states, encoding='utf-8', newline='') as file:
            cls.rows = list(csv.DictReader(file))
        cls.profile = tempfile.TemporaryDirectory()
        cls.browser = open_browser(cls.profile.name)

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()
        cls.profile.cleanup()
        super().tearDownClass()

    def setUp(self):
        self.browser.set_window_size(1280, 900)
        open_page(self.browser, self.page)

    def tearDown(self):
        self.assertEqual(complaints(self.browser), [])

    def js(self, script, *arguments):
        return self.browser.execute_script('return ' + script, *arguments)

    def time(self):
        return self.js('replay.time')

    def press(self, *keys):
        self.browser.find_element(By.TAG_NAME, 'body').send_keys(*keys)

    def click(self, selector):
        self.browser.find_element(By.CSS_SELECTOR, selector).click()

    def test_cars_are_where_the_csv_has_them(self):
        times = self.js('replay.run.times')
        by_moment = {}
        for row in self.rows:
            by_moment.setdefault(float(row['time_s']), []).append(row)
        self.assertGreater(len(times), 100)
        self.assertAlmostEqual(times[-1], max(by_moment), places=9)
        for k in (0, len(times) // 3, len(times) // 2, len(times) - 1):
            self.js('replay.seek(arguments[0])', times[k])
            for car, row in enumerate(by_moment[times[k]]):
                now = self.js('replay.carNow(arguments[0])', car)
                for name in ('x', 'y', 'z'):
                    self.assertLessEqual(abs(now[name] - float(row[name + '_m'])), 0.0051, (k, car, name))
                theta = 2 * math.atan2(now['qz'], now['qw'])
                turn = math.remainder(theta - float(row['theta_rad']), 2 * math.pi)
                self.assertLess(abs(math.degrees(turn)), 0.1, (k, car))
                self.assertEqual(now['look'] != 'on the track', row['derailed'] == '1')
                # What is drawn is what was read.
                drawn = self.js('replay.scenes[0].poses[arguments[0]].p.toArray()', car)
                self.assertLess(math.hypot(drawn[0] - now['x'], drawn[1] - now['y']), 1e-3)

    def test_forces_are_those_of_the_csv(self):
        times = self.js('replay.run.times')
        peaks = [0.0, 0.0]
        for row in self.rows:
            if row['buff_peak_N']:
                peaks = [max(peaks[0], float(row['buff_peak_N'])), max(peaks[1], float(row['draft_peak_N']))]
        for name, peak in zip(('buff', 'draft'), peaks):
            self.assertLessEqual(abs(self.js(f'Math.max(...replay.peaks.{name})') - peak), 501.0)
        self.assertEqual(len(times), self.js('replay.peaks.buff.length'))

    def test_what_users_type_stays_text(self):
        self.assertEqual(self.browser.find_element(By.TAG_NAME, 'h1').text, HOSTILE)
        self.assertIn(HOSTILE, self.browser.title)
        self.assertEqual(self.browser.find_elements(By.ID, 'evil'), [])
        self.js('replay.pick(0, 0)')
        self.assertIn('x</script><i>', self.browser.find_element(By.ID, 'picked-title').text)
        with open(self.page, encoding='utf-8') as file:
            text = file.read()
        self.assertEqual(text.count('<script'), text.count('</script>'))
        self.assertNotIn('<b id=evil>', text)

    def test_needs_no_other_file_and_no_network(self):
        loads = self.js('performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:"))')
        self.assertEqual(loads, [])

    def test_keys(self):
        self.press(Keys.HOME)
        self.assertEqual(self.time(), 0)
        self.press(Keys.ARROW_RIGHT)
        self.assertAlmostEqual(self.time(), 0.1)
        self.press('.')
        event = self.js('replay.run.events.filter(e => e.time > 0.1).reduce((a, b) => b.time < a.time ? b : a)')
        self.assertAlmostEqual(self.time(), event['time'])
        self.assertIn(event['text'], self.browser.find_element(By.ID, 'event').text)
        self.press('n')
        self.press('n')
        self.assertGreaterEqual(self.js('replay.picked'), 1)
        self.press(Keys.ESCAPE)
        self.assertIsNone(self.js('replay.picked'))
        self.press('+')
        self.assertEqual(self.js('replay.speed'), 2)
        for key, view in (('a', 'above'), ('t', 'train'), ('f', 'follow'), ('w', 'wreck')):
            self.press(key)
            self.assertEqual(self.js('document.querySelector("[aria-pressed=true]").dataset.view'), view)
        self.press(Keys.END)
        self.assertEqual(self.time(), self.js('replay.end'))

    def test_plays_and_pauses(self):
        self.click('#play')  # at the end: from the start
        wait(self.browser, 'return replay.time > 0.2 && replay.time < replay.end')
        self.click('#play')
        stopped = self.time()
        self.assertFalse(self.js('replay.playing'))
        self.press(' ')
        wait(self.browser, f'return replay.time > {stopped}')
        self.js('void replay.seek(replay.end - 0.01)')
        wait(self.browser, 'return !replay.playing')
        self.assertEqual(self.browser.find_element(By.ID, 'play').text, 'Play')

    def test_a_car_is_picked_by_a_click_on_it(self):
        self.press('a')
        canvas = self.browser.find_element(By.CSS_SELECTOR, '.scene canvas').rect
        places = [self.js('replay.scenes[0].screenPlace(arguments[0])', car) for car in range(10)]
        inside = [
            car for car, (x, y) in enumerate(places)
            if 10 < x - canvas['x'] < canvas['width'] - 10 and 10 < y - canvas['y'] < canvas['height'] - 10
        ]
        self.assertGreaterEqual(len(inside), 3)
        for car in inside[:3]:
            x, y = places[car]
            actions = ActionBuilder(self.browser)
            actions.pointer_action.move_to_location(round(x), round(y)).click()
            actions.perform()
            self.assertEqual(self.js('replay.picked'), car)
        row = [r for r in self.rows if r['car'] == str(inside[2] + 1)][-1]
        table = self.browser.find_element(By.ID, 'picked-table').text
        self.assertIn(f"{float(row['x_m']) / 0.3048:.0f} ft", table)
        # Its chart says values under the pointer.
        chart = self.browser.find_element(By.ID, 'over-time')
        ActionChains(self.browser).move_to_element(chart).perform()
        self.assertRegex(self.browser.find_element(By.ID, 'over-time-readout').text, r's; coupler \d+: .*kip.*kN')

    def test_events_can_be_clicked(self):
        rows = self.browser.find_elements(By.CSS_SELECTOR, 'table.events tbody tr')
        with open(self.path('incidents.csv'), encoding='utf-8', newline='') as file:
            broken = [r for r in csv.DictReader(file) if r['what'] == 'coupler_broken']
        texts = [r.text for r in rows]
        self.assertEqual(sum('coupler broken' in t for t in texts), len(broken))
        self.browser.execute_script('arguments[0].scrollIntoView({block: "center"})', rows[2])
        rows[2].click()
        self.assertAlmostEqual(self.time(), self.js('replay.run.events[2].time'))
        # On the time line.
        tick = self.js('replay.ticks[4]')
        line = self.browser.find_element(By.ID, 'events')
        size = line.size
        ActionChains(self.browser).move_to_element_with_offset(
            line, round(tick['x'] - size['width'] / 2), round(tick['y'] - size['height'] / 2)
        ).click().perform()
        self.assertLess(abs(self.time() - tick['event']['time']), 0.05)

    def test_outcome_has_both_units_and_sorts(self):
        text = self.browser.find_element(By.ID, 'outcome').text
        self.assertIn('peak buff force', text)
        self.assertRegex(text, r'kip .*kN')
        head = self.browser.find_element(By.CSS_SELECTOR, '#outcome thead th')
        self.browser.execute_script('arguments[0].scrollIntoView({block: "center"})', head)
        head.click()
        first = [r.text for r in self.browser.find_elements(By.CSS_SELECTOR, '#outcome tbody td:first-child')]
        self.assertEqual(first, sorted(first))

    def test_fits_a_phone(self):
        for width in (390, 1280):
            self.browser.execute_cdp_cmd('Emulation.setDeviceMetricsOverride',
                                         {'width': width, 'height': 844, 'deviceScaleFactor': 2, 'mobile': width < 500})
            open_page(self.browser, self.page)
            self.assertEqual(self.js('document.documentElement.clientWidth'), width)
            self.assertLessEqual(self.js('document.documentElement.scrollWidth'), width)
        self.browser.execute_cdp_cmd('Emulation.clearDeviceMetricsOverride', {})

    def test_scene_is_not_blank(self):
        colours = self.js('''(() => {
          const s = replay.scenes[0];
          s.renderer.render(s.scene, s.camera);
          const c = document.createElement('canvas');
          c.width = 320; c.height = 200;
          const g = c.getContext('2d');
          g.drawImage(s.canvas, 0, 0, 320, 200);
          const d = g.getImageData(0, 0, 320, 200).data, seen = new Set();
          for (let i = 0; i < d.length; i += 4) seen.add((d[i] >> 4) * 256 + (d[i + 1] >> 4) * 16 + (d[i + 2] >> 4));
          return seen.size;
        })()''')
        self.assertGreater(colours, 30)


class LongRunTest(PlotTest):
    def test_a_thousand_cars_stay_small(self):
        page = self.path('long.html')
        long = ('--set', 'consist[0].count=1000', '--set', 'stop.time_max=30 s')
        self.derail('run', self.path('scenario.yaml'), *long, '--html', page)
        self.assertLess(os.path.getsize(page), 6e6)


if __name__ == '__main__':
    run_tests()
