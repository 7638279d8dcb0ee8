#!/usr/bin/python3
"""derail run --html in a real browser: what it shows against the CSV of the same run, clicks, keys, sizes, escaping.

  test_replay_page.py path/to/derail
"""

import base64
import csv
import json
import math
import os
import struct
import subprocess
import zlib

import numpy as np
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions import interaction
from selenium.webdriver.common.actions.pointer_input import PointerInput
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from browser_testing import PageTest, open_page, wait
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


MAKE_PAGE = os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', '..', 'scripts', 'make_page.py')


def run_in(page):
    """The document that the only run of a page was made from: what packed_run of derail_pages/page.py does, backwards."""
    with open(page, encoding='utf-8') as file:
        packed = file.read().split('class="run">')[1].split('</script>')[0]
    data = zlib.decompress(base64.b64decode(packed))
    size = struct.unpack('<I', data[:4])[0]
    run = json.loads(data[4:4 + size])
    n, moments, fields, at = len(run['cars']), len(run['times']), run['fields'], 4 + size
    run['channels'] = []
    for width in [n] * len(fields['cars']) + [n - 1] * len(fields['couplers']) + [n, n] + [1] * len(fields['heap']):
        folded = np.frombuffer(data, np.uint8, 4 * moments * width, at).reshape(4, -1).T.copy().view('<u4').astype(np.int64)
        at += 4 * moments * width
        steps = (folded >> 1) ^ -(folded & 1)
        run['channels'].append(np.cumsum(steps.reshape(moments, width), axis=0).ravel().tolist())
    assert at == len(data)
    return run


class ReplayPageTest(PageTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.file, cls.page, cls.states = cls.path('hostile.yaml'), cls.path('replay.html'), cls.path('states.csv')
        with open(cls.file, 'w', encoding='utf-8') as file:
            file.write(SCENARIO)
        cls.derail('run', cls.file, '--html', cls.page, '--csv', cls.states, '--incidents', cls.path('incidents.csv'))
        with open(cls.states, encoding='utf-8', newline='') as file:
            cls.rows = list(csv.DictReader(file))

    def time(self):
        return self.js('replay.time')

    def press(self, *keys):
        self.browser.find_element(By.TAG_NAME, 'body').send_keys(*keys)

    def click(self, selector):
        self.browser.find_element(By.CSS_SELECTOR, selector).click()

    def test_the_time_line_has_the_colours_of_the_scene(self):
        self.assertEqual(self.browser.find_elements(By.CLASS_NAME, 'loading'), [], 'gone with the first frame')
        with open(self.page, encoding='utf-8') as file:
            self.assertIn('loading …</p>', file.read())
        colours, marks = self.js('replay.run.event_colours'), self.js('replay.run.marks')
        self.assertEqual(colours['fastest touch so far'], marks['star'])
        derailed = [e for e in self.js('replay.run.events') if e['kind'] == 'car derailed']
        looks = [look['colour'] for look in self.js('replay.run.looks')]
        self.assertTrue(derailed)
        for event in derailed:
            colour = self.js('replay.eventColour(arguments[0])', event)
            self.assertIn(colour, looks)
            self.assertNotEqual(colour, colours['past the point'])
        touches = [e['text'] for e in self.js('replay.run.events') if e['kind'] == 'fastest touch so far']
        self.assertTrue(touches and all('the fastest touch so far' in t for t in touches), touches)

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

    def test_cars_of_a_train_in_space_lie_as_the_csv_has_them(self):
        scenario = os.path.join(os.path.dirname(MAKE_PAGE), '..', 'config', 'accident3d.yaml')
        page, states = self.path('space.html'), self.path('space.csv')
        self.derail('run', scenario, '--set', 'consist[1].count=10', '--set', 'initial.cars_ahead=2',
                    '--set', 'output.interval=0.2', '--html', page, '--csv', states)
        with open(states, encoding='utf-8', newline='') as file:
            rows = list(csv.DictReader(file))
        end = max(float(row['time_s']) for row in rows)
        last = [row for row in rows if float(row['time_s']) == end]
        self.assertTrue(any(float(row['tilt_rad']) > math.pi / 4 for row in last), 'no car is over')
        open_page(self.browser, page)
        self.js('replay.seek(arguments[0])', end)
        for car, row in enumerate(last):
            now = self.js('replay.carNow(arguments[0])', car)
            for name in ('x', 'y', 'z'):
                self.assertLessEqual(abs(now[name] - float(row[name + '_m'])), 0.0051, (car, name))
            shown, wanted = (np.array([float(q[name]) for name in ('qx', 'qy', 'qz', 'qw')]) for q in (now, row))
            apart = min(np.linalg.norm(shown - wanted), np.linalg.norm(shown + wanted))  # both mean the same
            self.assertLess(2.0 * math.degrees(apart), 0.1, car)
            # What is drawn has its upward axis there: the body of a car that is over lies.
            up = self.js('((c) => { const q = replay.scenes[0].poses[c].q; return 1 - 2 * (q.x * q.x + q.y * q.y); })(arguments[0])', car)
            self.assertLess(abs(math.degrees(math.acos(max(-1.0, min(1.0, up)))) - math.degrees(float(row['tilt_rad']))), 0.5, car)

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
        self.assertAlmostEqual(self.time(), self.js('replay.end'))

    def test_keys_belong_to_what_has_the_focus(self):
        self.press(Keys.HOME)
        car = self.browser.find_element(By.ID, 'car')
        car.send_keys('3')
        car.send_keys('n', 'a', ' ', '.')  # no number, no key of the page
        self.assertEqual(self.time(), 0)
        self.assertFalse(self.js('replay.playing'))
        self.assertEqual(self.js('replay.view'), 'wreck')
        car.send_keys(Keys.ENTER)
        self.assertEqual(self.js('replay.picked'), 2)
        slider = self.browser.find_element(By.ID, 'time')
        slider.send_keys(Keys.END)  # its own: once
        self.assertAlmostEqual(self.time(), self.js('replay.end'))
        slider.send_keys(Keys.HOME)
        self.assertEqual(self.time(), 0)
        slider.send_keys('a')  # none of its own
        self.assertEqual(self.js('replay.view'), 'above')
        summary = self.browser.find_element(By.CSS_SELECTOR, '#replay summary')
        summary.send_keys(Keys.ENTER)
        summary.send_keys(' ')
        self.assertFalse(self.js('replay.playing'))
        self.assertFalse(self.js('document.querySelector("#replay details").open'), 'twice')
        train = self.browser.find_element(By.CSS_SELECTOR, '[data-view=train]')
        train.send_keys(' ')
        self.assertEqual(self.js('replay.view'), 'train')
        self.assertFalse(self.js('replay.playing'))
        self.browser.find_element(By.ID, 'play').send_keys(' ')
        self.assertTrue(self.js('replay.playing'), 'once, not twice')
        self.browser.find_element(By.ID, 'play').send_keys(' ')
        self.assertFalse(self.js('replay.playing'))

    def test_every_stop_of_the_tab_key_has_a_name_and_does_something(self):
        stops = self.js('''[...document.querySelectorAll('a[href],button,select,input,summary,[tabindex="0"]')]
          .filter(e => e.offsetParent !== null).map(e => [e.tagName, e.id,
            (e.getAttribute('aria-label') || e.textContent || (e.labels && e.labels[0] ? e.labels[0].textContent : '')).trim()])''')
        self.assertGreater(len(stops), 10)
        for tag, name, words in stops:
            self.assertTrue(words or (tag == 'TH'), (tag, name))
            self.assertTrue(tag != 'CANVAS' or name in ('along', 'largest', 'over-time'), (tag, name))
        chart = self.browser.find_element(By.ID, 'along')
        chart.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
        self.assertIn('coupler 2 at', self.browser.find_element(By.ID, 'along-readout').text)
        chart.send_keys(Keys.ENTER)
        self.assertEqual(self.js('replay.picked'), 1)

    def test_between_two_moments_a_car_turns_the_short_way(self):
        half = [math.radians(5.0), math.radians(10.0)]
        first, last = (math.sin(half[0]), math.cos(half[0])), (-math.sin(half[1]), -math.cos(half[1]))  # 10 and 20 degrees
        theta = self.js('''((first, last) => {
          const run = Object.assign(new Run(), {times: [0, 1], count: 1, cars: [{centre_height: 0}], car: {}});
          const channel = values => ({step: 1 / 4096, width: 1, values: Int32Array.from(values, v => Math.round(4096 * v))});
          for (const name of ['x', 'y', 'z', 'qx', 'qy']) run.car[name] = channel([0, 0]);
          run.car.qz = channel([first[0], last[0]]);
          run.car.qw = channel([first[1], last[1]]);
          run.turnShort();
          const {q} = run.pose(run.moment(0.5), 0, {p: new THREE.Vector3(), q: new THREE.Quaternion()});
          return 2 * Math.atan2(q.z, q.w);
        })(arguments[0], arguments[1])''', first, last)
        self.assertAlmostEqual(math.degrees(theta), 15.0, delta=0.1)

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

    def test_numbers_on_roofs_are_those_of_the_cars(self):
        # Cars that the camera does not see are left out; the others keep their numbers.
        self.js('replay.setView("follow")')
        self.js('replay.pick(8, 0)')
        wait(self.browser, 'return replay.asleep')
        for near in (False, True):
            drawn = self.js('''(near => {
              const s = replay.scenes[0];
              if (near) s.camera.position.copy(s.controls.target).add(new THREE.Vector3(-2, -14, 9));
              s.controls.update(); s.dirty = true; s.render();
              const matrix = new THREE.Matrix4(), found = [];
              for (let k = 0; k < s.numbers.used; ++k) {
                s.numbers.mesh.getMatrixAt(k, matrix);
                const p = new THREE.Vector3().setFromMatrixPosition(matrix), cell = [s.cell.getX(k), s.cell.getY(k)];
                const near = s.poses.map((pose, i) => [pose.p.clone().sub(p).length(), i]).sort((a, b) => a[0] - b[0])[0][1];
                found.push([near, s.cells.findIndex(c => Math.abs(c[0] - cell[0]) + Math.abs(c[1] - cell[1]) < 1e-6)]);
              }
              return found;
            })(arguments[0])''', near)
            self.assertEqual([a for a, _ in drawn], [b for _, b in drawn])
        self.assertLess(len(drawn), 10, 'some are out of the picture')

    def test_a_car_is_picked_by_a_finger(self):
        self.press('a')
        canvas = self.browser.find_element(By.CSS_SELECTOR, '.scene canvas').rect
        car, (x, y) = next(
            (car, (x, y)) for car in range(10) for x, y in [self.js('replay.scenes[0].screenPlace(arguments[0])', car)]
            if 10 < x - canvas['x'] < canvas['width'] - 10 and 10 < y - canvas['y'] < canvas['height'] - 10)
        finger = ActionBuilder(self.browser, mouse=PointerInput(interaction.POINTER_TOUCH, 'finger'))
        finger.pointer_action.move_to_location(round(x), round(y)).pointer_down().pointer_up()
        finger.perform()
        self.assertEqual(self.js('replay.picked'), car)

    def test_the_view_that_was_chosen_outlives_a_change_of_size(self):
        direction = '''(() => { const s = replay.scenes[0], d = s.camera.position.clone().sub(s.controls.target);
          return [...d.normalize().toArray(), ...s.controls.target.toArray()]; })()'''
        before = self.js(direction)
        self.browser.set_window_size(1000, 800)
        wait(self.browser, 'return replay.scenes[0].canvas.clientWidth < 1000 && replay.asleep')
        for a, b in zip(self.js(direction), before):  # nobody has turned it: framed anew, from the same direction
            self.assertAlmostEqual(a, b, places=2)
        canvas = self.browser.find_element(By.CSS_SELECTOR, '.scene canvas')
        ActionChains(self.browser).drag_and_drop_by_offset(canvas, 150, 20).perform()
        wait(self.browser, 'return replay.asleep')
        turned, place = self.js(direction), self.js('replay.scenes[0].camera.position.toArray()')
        self.assertGreater(math.dist(turned[:3], before[:3]), 0.1)
        self.browser.set_window_size(1280, 900)
        wait(self.browser, 'return replay.scenes[0].canvas.clientWidth > 1000 && replay.asleep')
        self.assertEqual(self.js('replay.scenes[0].camera.position.toArray()'), place)

    def test_colours_tell_how_cars_lie_on_demand(self):
        words = '.legend'
        self.assertIn('derailed', self.browser.find_element(By.CSS_SELECTOR, words).text)
        self.press('l')
        text = self.browser.find_element(By.CSS_SELECTOR, words).text
        self.assertIn('upright', text)
        self.assertNotIn('derailed', text)
        self.assertTrue(self.browser.find_element(By.ID, 'lies').is_selected())
        self.click('#lies')
        self.assertIn('derailed', self.browser.find_element(By.CSS_SELECTOR, words).text)

    def test_several_runs_stand_side_by_side(self):
        runs = [run_in(self.page), run_in(self.page)]
        other = '<i>second</i> & last'
        runs[0]['caption'], runs[1]['caption'] = 'median', other
        runs[1]['times'] = [0.5 * t for t in runs[1]['times']]
        page = self.path('several.html')
        document = json.dumps({'version': '1.2.3', 'title': 'members of <b>a</b> study', 'notes': ['how they <i>were</i> chosen'], 'runs': runs})
        with open(page, 'wb') as file:
            subprocess.run([MAKE_PAGE, 'replay'], input=document.encode(), stdout=file, check=True)
        open_page(self.browser, page)
        self.assertEqual(self.browser.find_element(By.TAG_NAME, 'h1').text, 'members of <b>a</b> study')
        captions = [e.text for e in self.browser.find_elements(By.CSS_SELECTOR, 'figcaption')]
        self.assertEqual(captions, ['median', other])
        self.assertEqual(self.js('replay.scenes.length'), 2)
        self.assertAlmostEqual(self.js('replay.end'), self.js('replay.runs[0].end'))
        self.assertAlmostEqual(self.js('replay.runs[1].end'), 0.5 * self.js('replay.end'))
        # A click into a scene makes its run the one that charts and keys are about.
        second = self.browser.find_elements(By.CSS_SELECTOR, '.scene canvas')[1]
        ActionChains(self.browser).move_to_element_with_offset(second, 0, round(-0.45 * second.size['height'])).click().perform()
        self.assertEqual(self.js('replay.active'), 1)
        rows = self.browser.find_elements(By.CSS_SELECTOR, 'table.events[data-run="1"] tbody tr')
        self.browser.execute_script('arguments[0].scrollIntoView({block: "center"})', rows[2])
        rows[2].click()
        self.assertAlmostEqual(self.time(), self.js('replay.runs[1].events[2].time'))
        heads = self.browser.find_element(By.CSS_SELECTOR, '#outcome thead').text
        self.assertIn('median', heads)
        self.assertIn(other, heads)

    def test_north_is_shown_where_the_scenario_knows_it(self):
        self.assertFalse(self.browser.find_element(By.CSS_SELECTOR, '.north').is_displayed())
        run = run_in(self.page)
        run['track']['north'] = [0.0, 1.0]  # the track leads to the east
        page = self.path('north.html')
        with open(page, 'wb') as file:
            subprocess.run([MAKE_PAGE, 'replay'], input=json.dumps({'version': '1', 'title': '', 'notes': [], 'runs': [run]}).encode(), stdout=file, check=True)
        open_page(self.browser, page)
        self.press('a')  # from above, with the left of the track at the top
        wait(self.browser, 'return replay.asleep')
        self.assertTrue(self.browser.find_element(By.CSS_SELECTOR, '.north').is_displayed())
        turn = 'parseFloat(document.querySelector(".north g").getAttribute("transform").slice(7))'
        self.assertAlmostEqual(self.js(turn), 0.0, delta=1.0)
        self.js('''(() => { const s = replay.scenes[0], t = s.controls.target;  // from the east
          s.camera.position.set(t.x + 100, t.y, t.z + 60); s.controls.update(); })()''')
        wait(self.browser, 'return replay.asleep')
        self.assertAlmostEqual(self.js(turn), 90.0, delta=1.0)

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
