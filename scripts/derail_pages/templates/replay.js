'use strict';

// ---- The data of a run -------------------------------------------------------------------------------------------

async function inflated(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// See packed_channels in derail_pages/page.py.
function unpack(bytes, offset, moments, width) {
  const n = moments * width, values = new Int32Array(n);
  for (let plane = 0; plane < 4; ++plane) {
    const from = offset + plane * n, shift = 8 * plane;
    for (let i = 0; i < n; ++i) values[i] |= bytes[from + i] << shift;
  }
  for (let i = 0; i < n; ++i) {
    const v = values[i];
    values[i] = ((v >>> 1) ^ -(v & 1)) + (i >= width ? values[i - width] : 0);
  }
  return values;
}

class Run {
  static async read(base64) {
    const bytes = await inflated(base64), length = new DataView(bytes.buffer).getUint32(0, true);
    const run = Object.assign(new Run(), JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length))));
    const {times} = run;
    run.count = run.cars.length;
    run.end = times[times.length - 1];
    let offset = 4 + length;
    const take = width => {
      const values = unpack(bytes, offset, times.length, width);
      offset += 4 * times.length * width;
      return values;
    };
    run.car = {};
    run.coupler = {};
    for (const field of run.fields.cars) run.car[field.name] = {field, step: field.step, values: take(run.count), width: run.count};
    for (const field of run.fields.couplers) {
      run.coupler[field.name] = {field, step: field.step, values: take(run.count - 1), width: run.count - 1};
    }
    run.look = take(run.count);
    run.lie = take(run.count);
    run.heap = {};
    for (const {name, step} of run.fields.heap) run.heap[name] = {step, values: take(1), width: 1};
    run.turnShort();
    return run;
  }
  // A quaternion and its negative are the same direction: of the two, the one that is nearer to that of the moment before. What lies
  // between is then on the shorter arc.
  turnShort() {
    const parts = ['qx', 'qy', 'qz', 'qw'].map(name => this.car[name].values), n = this.count;
    for (let i = n; i < n * this.times.length; ++i) {
      let product = 0;
      for (const part of parts) product += part[i] * part[i - n];
      if (product < 0) for (const part of parts) part[i] = -part[i];
    }
  }
  // The moment at or before t, and how far t is on the way to the next one.
  moment(t) {
    const {times} = this;
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= t + 1e-9) low = middle; else high = middle - 1;
    }
    const next = Math.min(low + 1, times.length - 1);
    return {at: low, next, share: next === low ? 0 : Math.max(0, (t - times[low]) / (times[next] - times[low]))};
  }
  value(channel, m, i) {
    const a = channel.values[m.at * channel.width + i], b = channel.values[m.next * channel.width + i];
    return (a + (b - a) * m.share) * channel.step;
  }
  // A value that is not interpolated.
  held(channel, m, i) { return channel.values[m.at * channel.width + i] * channel.step; }
  lookOf(m, i) { return this.look[m.at * this.count + i]; }
  lieOf(m, i) { return this.lie[m.at * this.count + i]; }
  // What its colour and its bars say: why it is where it is, or how it lies.
  saidOf(m, i, lies) { return lies ? this.lies[this.lieOf(m, i)] : this.looks[this.lookOf(m, i)]; }
  pose(m, i, out) {
    const {car} = this;
    let x = this.value(car.qx, m, i), y = this.value(car.qy, m, i), z = this.value(car.qz, m, i), w = this.value(car.qw, m, i);
    const k = 1 / (Math.hypot(x, y, z, w) || 1);
    out.q.set(x * k, y * k, z * k, w * k);
    ({x, y, z, w} = out.q);
    // The middle between the trucks on the rails, from the centre of mass.
    const below = this.cars[i].centre_height;
    out.p.set(this.value(car.x, m, i) - below * 2 * (x * z + w * y), this.value(car.y, m, i) - below * 2 * (y * z - w * x),
      this.value(car.z, m, i) + below * 2 * (x * x + y * y));
    return out;
  }
  forceClass(force) {
    let k = 0;
    for (const step of this.forces.steps) if (Math.abs(force) >= step) ++k;
    return force < 0 ? -k : k;
  }
  forceColour(k) { return this.forces.colours[k + this.forces.steps.length]; }
}

// Texts of a value in the unit that people read, and in SI.
function shown(value, unit) {
  if (!unit.shown) return inSi(value, unit);
  return `${(value / unit.per_shown).toFixed(unit.shown_digits)} ${unit.shown}`;
}
function inSi(value, unit) {
  return unit.si === '' || unit.si === '1' ? String(value) : `${(value / unit.per_table_si).toFixed(unit.table_si_digits)} ${unit.table_si}`;
}
const line = ({colour, dash}) => ({colour: css(colour), dash});
const css = ([r, g, b]) => `rgb(${r}, ${g}, ${b})`;

// ---- The scene ---------------------------------------------------------------------------------------------------

const UP = new THREE.Vector3(0, 0, 1), ONE = new THREE.Vector3(1, 1, 1);

function geometryOf(millimetres) {
  const points = new Float32Array(millimetres.length);
  for (let i = 0; i < points.length; ++i) points[i] = 0.001 * millimetres[i];
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(points, 3));
  geometry.computeVertexNormals();
  return geometry;
}
// Light on what never moves is worked out once: level ground keeps its colour.
function shaded(geometry) {
  const {normal} = geometry.attributes, colours = new Float32Array(3 * normal.count);
  for (let i = 0; i < normal.count; ++i) {
    const light = Math.max(0.35, Math.min(1.2, 0.9 * normal.getZ(i) + 0.1 - 0.35 * normal.getX(i) - 0.6 * normal.getY(i)));
    colours.fill(light, 3 * i, 3 * i + 3);
  }
  geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
  geometry.deleteAttribute('normal');
  return geometry;
}
function quadGeometry() {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(
    [-0.5, -0.5, 0, 0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, 0.5, 0]), 3));
  geometry.setAttribute('uv', new THREE.BufferAttribute(new Float32Array([0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1]), 2));
  geometry.computeVertexNormals();
  return geometry;
}
const colourOf = ([r, g, b]) => new THREE.Color(r / 255, g / 255, b / 255);

// Many of one shape in one call, each with a colour of its own.
class Many {
  constructor(scene, geometry, most, {tinted = true, material, order = 0} = {}) {
    this.tint = new THREE.InstancedBufferAttribute(new Float32Array(3 * most), 3);
    if (tinted) geometry.setAttribute('tint', this.tint);
    this.material = material || new THREE.MeshLambertMaterial({color: 0xffffff});
    if (tinted) {
      this.material.onBeforeCompile = shader => {
        shader.vertexShader = 'attribute vec3 tint;\nvarying vec3 vTint;\n' +
          shader.vertexShader.replace('#include <begin_vertex>', '#include <begin_vertex>\nvTint = tint;');
        shader.fragmentShader = 'varying vec3 vTint;\n' +
          shader.fragmentShader.replace('#include <color_fragment>', '#include <color_fragment>\ndiffuseColor.rgb *= vTint;');
      };
    }
    this.mesh = new THREE.InstancedMesh(geometry, this.material, most);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = order;
    this.most = most;
    scene.add(this.mesh);
    this.begin();
  }
  begin() { this.used = 0; }
  add(matrix, colour) {
    if (this.used >= this.most) return;
    this.mesh.setMatrixAt(this.used, matrix);
    if (colour) this.tint.setXYZ(this.used, colour[0] / 255, colour[1] / 255, colour[2] / 255);
    ++this.used;
  }
  finish() {
    this.mesh.count = this.used;
    this.mesh.visible = this.used > 0;
    this.mesh.instanceMatrix.needsUpdate = true;
    this.tint.needsUpdate = true;
  }
}

const STARS = 64;
// Wall milliseconds that a frame may take, and for how long it may take more before there are fewer pixels.
// Ground around the heap in the picture [m].
const HEAP_ROOM = 8;
// Time in which the view follows the heap, simulated [s].
const FOLLOW_TIME = 0.5;
const FRAME_MOST = 40, SLOW_MOST = 250;

// Without a graphics card every pixel costs time of the processor.
function drawnBySoftware() {
  const gl = document.createElement('canvas').getContext('webgl');
  const info = gl && gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
  if (gl) gl.getExtension('WEBGL_lose_context').loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

class Scene {
  constructor(figure, run, index, app) {
    Object.assign(this, {figure, run, index, app, canvas: figure.querySelector('canvas')});
    this.sharpness = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, stencil: false,
      antialias: this.sharpness < 1.5 && !drawnBySoftware()});
    this.renderer.setPixelRatio(this.sharpness);
    this.slow = 0;
    const sky = colourOf(run.marks.sky);
    this.renderer.setClearColor(sky);
    this.scene = new THREE.Scene();
    this.scene.fog = new THREE.Fog(sky, 900, 3500);
    this.camera = new THREE.PerspectiveCamera(38, 1, 1, 6000);
    this.camera.up.copy(UP);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8a80, 0.82));
    const sun = new THREE.DirectionalLight(0xffffff, 0.42);
    sun.position.set(-0.4, -0.7, 1);
    this.scene.add(sun);
    this.addTrack();
    this.addCars();
    this.addRest();
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.maxPolarAngle = 0.49 * Math.PI;
    this.controls.minDistance = 8;
    this.controls.maxDistance = 3000;
    this.controls.enableKeys = false;
    this.canvas.removeAttribute('tabindex');  // which the controls have set: there is nothing to do for keys
    this.controls.screenSpacePanning = false;
    this.controls.addEventListener('start', () => { this.moved = true; });
    this.canvas.addEventListener('wheel', () => { this.moved = true; }, {passive: true});
    this.controls.addEventListener('change', () => { this.dirty = true; app.wake(); });
    this.dirty = true;
    this.target = new THREE.Vector3();
    this.listen();
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.resize();
  }
  addTrack() {
    const {track} = this.run;
    track.parts.forEach((part, i) => {
      if (part.points.length === 0) return;
      // What lies flat on something else is drawn after it, a little nearer.
      const mesh = new THREE.Mesh(shaded(geometryOf(part.points)), new THREE.MeshBasicMaterial({color: colourOf(part.colour),
        vertexColors: THREE.VertexColors, polygonOffset: true, polygonOffsetFactor: -i, polygonOffsetUnits: -4 * i}));
      mesh.position.z = track.height;
      mesh.renderOrder = i;
      this.scene.add(mesh);
    });
  }
  addCars() {
    const {run} = this, byShape = run.shapes.map(() => 0);
    for (const car of run.cars) ++byShape[car.shape];
    const ink = new THREE.MeshLambertMaterial({color: colourOf(run.marks.ink)});
    this.shapes = run.shapes.map((shape, k) => ({
      body: new Many(this.scene, geometryOf(shape.body), byShape[k]),
      dark: new Many(this.scene, geometryOf(shape.dark), byShape[k], {tinted: false, material: ink}),
      top: shape.top, width: shape.top_half_width, end: shape.top_end,
    }));
    this.plates = new Many(this.scene, quadGeometry(), 8 * run.count);
    this.addNumbers();
    this.poses = run.cars.map(() => ({p: new THREE.Vector3(), q: new THREE.Quaternion(), matrix: new THREE.Matrix4()}));
    this.outline = new THREE.LineSegments(new THREE.EdgesGeometry(new THREE.BoxBufferGeometry(1, 1, 1)),
      new THREE.LineBasicMaterial({color: colourOf(run.marks.chosen), depthTest: false}));
    this.outline.visible = false;
    this.outline.matrixAutoUpdate = false;
    this.outline.renderOrder = 99;
    this.scene.add(this.outline);
  }
  // Numbers on roofs: one picture of all, a cell each.
  addNumbers() {
    const {run} = this, columns = Math.ceil(Math.sqrt(run.count / 2)), rows = Math.ceil(run.count / columns);
    const w = 2 ** Math.max(5, Math.min(7, Math.floor(Math.log2(2048 / columns)))), h = w / 2;
    const size = n => 2 ** Math.ceil(Math.log2(n));
    const picture = document.createElement('canvas');
    picture.width = size(columns * w);
    picture.height = size(rows * h);
    const c = pen(picture);
    c.fillStyle = '#fff';
    c.fillRect(0, 0, picture.width, picture.height);
    c.fillStyle = css(run.marks.ink);
    c.textAlign = 'center';
    c.textBaseline = 'middle';
    c.font = `bold ${Math.round(0.74 * h)}px sans-serif`;
    this.cells = [];  // of each car: x, y, width, height
    for (let i = 0; i < run.count; ++i) {
      const x = (i % columns) * w, y = Math.floor(i / columns) * h;
      c.fillText(String(i + 1), x + w / 2, y + h / 2, w - 2);
      this.cells.push([x / picture.width, 1 - (y + h) / picture.height, w / picture.width, h / picture.height]);
    }
    const texture = new THREE.CanvasTexture(picture);
    texture.anisotropy = 4;
    const geometry = quadGeometry();
    this.cell = new THREE.InstancedBufferAttribute(new Float32Array(4 * run.count), 4);
    geometry.setAttribute('cell', this.cell);
    const material = new THREE.MeshBasicMaterial({map: texture, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -2});
    this.numbers = new Many(this.scene, geometry, run.count, {tinted: true, material});
    const tint = material.onBeforeCompile;
    material.onBeforeCompile = shader => {
      tint(shader);
      shader.vertexShader = 'attribute vec4 cell;\n' + shader.vertexShader.replace('#include <uv_vertex>', 'vUv = cell.xy + uv * cell.zw;');
    };
  }
  addRest() {
    const {run} = this, {marks} = run;
    this.bars = new Many(this.scene, new THREE.BoxBufferGeometry(1, 1, 1), Math.max(1, run.count - 1));
    const arrow = new THREE.Shape();
    marks.arrow_outline.forEach(([x, y], k) => { if (k === 0) arrow.moveTo(x, y); else arrow.lineTo(x, y); });
    this.arrows = new Many(this.scene, new THREE.ExtrudeBufferGeometry(arrow, {depth: 1, bevelEnabled: false}), Math.max(1, 2 * run.count));
    const star = new THREE.Shape();
    for (let i = 0; i < 2 * marks.star_rays; ++i) {
      const r = i % 2 === 0 ? 1 : marks.star_inner, a = i * Math.PI / marks.star_rays;
      if (i === 0) star.moveTo(r, 0); else star.lineTo(r * Math.cos(a), r * Math.sin(a));
    }
    this.stars = new Many(this.scene, new THREE.ShapeBufferGeometry(star), STARS, {tinted: false,
      material: new THREE.MeshBasicMaterial({color: colourOf(marks.star), side: THREE.DoubleSide})});
    const words = document.createElement('canvas');
    words.width = 512; words.height = 64;
    const c = pen(words);
    c.font = 'bold 44px sans-serif'; c.fillStyle = '#fff'; c.strokeStyle = '#222'; c.lineWidth = 6; c.textAlign = 'center'; c.textBaseline = 'middle';
    c.strokeText('point of derailment', 256, 32); c.fillText('point of derailment', 256, 32);
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({map: new THREE.CanvasTexture(words)}));
    sprite.scale.set(28, 3.5, 1);
    sprite.position.set(run.track.pod_name[0], run.track.pod_name[1], run.track.pod_name[2] + run.track.height + 2);
    this.scene.add(sprite);
  }
  listen() {
    let down = null;
    this.canvas.addEventListener('pointerdown', e => {
      down = e.isPrimary && e.button === 0 ? {id: e.pointerId, x: e.clientX, y: e.clientY} : null;  // a second finger: no click
      this.app.focusOn(this.index);
    });
    this.canvas.addEventListener('pointercancel', () => { down = null; });
    // A touch that is kept from scrolling yields no click in all browsers.
    this.canvas.ownerDocument.addEventListener('pointerup', e => {
      if (!down || e.pointerId !== down.id) return;
      const still = Math.hypot(e.clientX - down.x, e.clientY - down.y) <= (e.pointerType === 'touch' ? 12 : 6);
      down = null;
      if (!still) return;
      const box = this.canvas.getBoundingClientRect();
      this.app.pick(this.carAt((e.clientX - box.left) / box.width, (e.clientY - box.top) / box.height), this.index);
    });
    this.canvas.addEventListener('webglcontextlost', e => { e.preventDefault(); this.app.complain('The browser has taken the scene\u2019s memory away: load the page again.'); });
  }
  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
    if (!this.moved) this.view(this.app.view);
    this.app.wake();
  }
  // The heap of cars at a moment: a rectangle on the ground.
  heap(m) {
    const {heap} = this.run, of = name => this.run.held(heap[name], m, 0);
    return {x: of('x'), y: of('y'), z: of('z'), yaw: of('yaw'), length: of('length'), width: of('width')};
  }
  // The box around it with its sides along the axes, and some ground around it.
  heapBox(m) {
    const {x, y, z, yaw, length, width} = this.heap(m), c = Math.abs(Math.cos(yaw)), s = Math.abs(Math.sin(yaw));
    const long = length + HEAP_ROOM, wide = width + HEAP_ROOM;
    return new THREE.Box3().setFromCenterAndSize(new THREE.Vector3(x, y, z), new THREE.Vector3(c * long + s * wide, s * long + c * wide, 0));
  }
  // Looks at a box from a direction so that it fills the view.
  frame(box, direction) {
    const centre = box.getCenter(new THREE.Vector3());
    const ground = centre.z + this.run.track.height;
    centre.z = ground + 1;
    const size = box.getSize(new THREE.Vector3());
    const d = direction.clone().normalize();
    this.camera.position.copy(centre).add(d);
    this.camera.lookAt(centre);
    this.camera.updateMatrixWorld(true);
    const inverse = new THREE.Matrix4().getInverse(this.camera.matrixWorld);
    const tan = Math.tan(this.camera.fov * Math.PI / 360);
    let distance = 20;
    for (const x of [-0.5, 0.5]) for (const y of [-0.5, 0.5]) for (const z of [0, 1]) {
      const p = new THREE.Vector3(centre.x + x * size.x, centre.y + y * size.y, ground + z * 5).applyMatrix4(inverse);
      // At distance k + 1 of the camera the point is k farther away.
      const need = Math.max(Math.abs(p.x) / (tan * this.camera.aspect), Math.abs(p.y) / tan);
      distance = Math.max(distance, need + p.z + 1);
    }
    this.camera.position.copy(centre).addScaledVector(d, 1.06 * distance);
    this.controls.target.copy(centre);
    this.controls.update();
    this.dirty = true;
  }
  view(name) {
    const {run} = this;
    this.moved = false;
    if (name === 'train') {
      const m = run.moment(this.app.time), box = new THREE.Box3();
      for (let i = 0; i < run.count; ++i) box.expandByPoint(this.placeOf(m, i, new THREE.Vector3()));
      box.expandByScalar(12);
      this.frame(box, new THREE.Vector3(-0.25, -1, 0.55));
    } else if (name === 'follow') {
      const half = new THREE.Vector3(45, 25, 2), at = this.followed(run.moment(this.app.time), new THREE.Vector3());
      this.frame(new THREE.Box3(at.clone().sub(half), at.clone().add(half)), new THREE.Vector3(-0.55, -1, 0.8));
      this.lastFollowed = at;
    } else {
      this.frame(this.heapBox(run.moment(run.end)), name === 'above' ? new THREE.Vector3(0, -0.02, 1) : new THREE.Vector3(-0.35, -1, 0.85));
    }
  }
  placeOf(m, i, out) { return out.set(this.run.value(this.run.car.x, m, i), this.run.value(this.run.car.y, m, i), this.run.value(this.run.car.z, m, i)); }
  // The car that was picked; else the heap, which for a short while moves from one group of cars to another.
  followed(m, out) {
    const {run, app} = this;
    if (app.picked !== null && app.picked < run.count) return this.placeOf(m, app.picked, out);
    const {x, y, z} = this.heap(m);
    return out.set(x, y, z);
  }
  carAt(u, v) {
    const ray = new THREE.Raycaster();
    this.camera.updateMatrixWorld();
    ray.setFromCamera(new THREE.Vector2(2 * u - 1, 1 - 2 * v), this.camera);
    let best = null, least = Infinity;
    const inverse = new THREE.Matrix4(), hit = new THREE.Vector3(), local = new THREE.Ray(), box = new THREE.Box3();
    this.poses.forEach((pose, i) => {
      const {length, width, roof} = this.run.cars[i];
      box.min.set(-length / 2, -width / 2 - 0.3, 0);
      box.max.set(length / 2, width / 2 + 0.3, roof);
      local.copy(ray.ray).applyMatrix4(inverse.getInverse(pose.matrix));
      if (!local.intersectBox(box, hit)) return;
      const distance = hit.applyMatrix4(pose.matrix).distanceTo(ray.ray.origin);
      if (distance < least) { least = distance; best = i; }
    });
    return best;
  }
  // Where a car is on the page, in pixels of the window: for tests, and for whoever drives the page.
  screenPlace(i) {
    this.camera.updateMatrixWorld();
    const pose = this.poses[i], p = new THREE.Vector3(0, 0, this.run.cars[i].roof).applyMatrix4(pose.matrix).project(this.camera);
    const box = this.canvas.getBoundingClientRect();
    return [box.left + (p.x + 1) / 2 * box.width, box.top + (1 - p.y) / 2 * box.height];
  }
  update(time) {
    this.time = time;
    const {run} = this, m = run.moment(Math.min(time, run.end));
    for (let i = 0; i < run.count; ++i) {
      const pose = run.pose(m, i, this.poses[i]);
      pose.p.z += run.marks.layer_step * (i % run.marks.layers);
      pose.matrix.compose(pose.p, pose.q, ONE);
    }
    const {picked} = this.app;
    this.outline.visible = picked !== null && picked < run.count;
    if (this.outline.visible) {
      const car = run.cars[picked];
      this.outline.matrix.compose(new THREE.Vector3(0, 0, car.roof / 2), new THREE.Quaternion(), new THREE.Vector3(car.length, car.width + 0.4, car.roof))
        .premultiply(this.poses[picked].matrix);
      this.outline.matrixWorldNeedsUpdate = true;
    }
    if (this.app.view === 'follow') this.follow(m, time);
    this.dirty = true;
  }
  // A chosen car exactly; the heap smoothly, as RViz does.
  follow(m, time) {
    const at = this.followed(m, new THREE.Vector3()), {lastFollowed: last} = this;
    if (last) {
      const passed = Math.abs(time - this.followedAt);
      if (this.app.picked === null && passed < 1) at.copy(last.clone().lerp(at, 1 - Math.exp(-passed / FOLLOW_TIME)));
      const shift = at.clone().sub(last);
      this.camera.position.add(shift);
      this.controls.target.add(shift);
      this.controls.update();
    }
    this.lastFollowed = at;
    this.followedAt = time;
  }
  // Fills the collections with what the camera sees.
  place() {
    const {run, time} = this, {marks} = run, m = run.moment(Math.min(time, run.end));
    const local = new THREE.Matrix4(), turn = new THREE.Quaternion(), none = new THREE.Quaternion();
    const place = new THREE.Vector3(), size = new THREE.Vector3();
    const collections = [this.plates, this.numbers, this.bars, this.arrows, this.stars];
    for (const shape of this.shapes) collections.push(shape.body, shape.dark);
    for (const c of collections) c.begin();
    const quad = (pose, x, z, length, width, into, colour) => {
      local.compose(place.set(x, 0, z), none, size.set(length, width, 1));
      into.add(local.premultiply(pose.matrix), colour);
    };
    this.camera.updateMatrixWorld();
    const seen = new THREE.Frustum().setFromMatrix(new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse));
    const sphere = new THREE.Sphere();
    for (let i = 0; i < run.count; ++i) {
      const pose = this.poses[i], car = run.cars[i], look = run.saidOf(m, i, this.app.lies), shape = this.shapes[car.shape];
      sphere.center.copy(pose.p);
      sphere.radius = 0.5 * car.length + car.above + 2;
      if (!seen.intersectsSphere(sphere)) continue;
      shape.body.add(pose.matrix, look.colour);
      shape.dark.add(pose.matrix);
      this.cell.setXYZW(this.numbers.used, ...this.cells[i]);
      quad(pose, 0, car.roof + 0.05, marks.plate[0], Math.min(marks.plate[1], car.width), this.numbers, look.colour);
      const top = shape.top + 0.03, broken = k => k >= 0 && k < run.count - 1 && run.held(run.coupler.broken, m, k) > 0.5;
      for (let b = 0; b < look.bars; ++b) {
        const x = 0.5 * shape.end + marks.bar_spacing * (b - 0.5 * (look.bars - 1));
        for (const side of [-1, 1]) quad(pose, side * x, top, marks.bar_width, 2 * shape.width, this.plates, marks.ink);
      }
      if (broken(i - 1)) quad(pose, (1 - 0.5 * marks.broken_end) * shape.end, top, marks.broken_end * shape.end, 2 * shape.width, this.plates, marks.broken);
      if (broken(i)) quad(pose, -(1 - 0.5 * marks.broken_end) * shape.end, top, marks.broken_end * shape.end, 2 * shape.width, this.plates, marks.broken);
      const [least, step, wide, high] = marks.arrow;
      for (const front of [true, false]) {
        const k = front ? i - 1 : i;
        if (k < 0 || k >= run.count - 1 || broken(k)) continue;
        const force = run.forceClass(run.held(run.coupler.axial_force, m, k));
        if (force === 0) continue;
        const length = least + step * Math.abs(force), out = front ? 1 : -1, end = out * 0.5 * car.length;
        const heading = force > 0 ? out : -out;
        place.set(end - out * length / 2, 0, car.above);
        turn.setFromAxisAngle(UP, heading > 0 ? 0 : Math.PI);
        local.compose(place, turn, size.set(length, wide, high));
        this.arrows.add(local.premultiply(pose.matrix), run.forceColour(force));
      }
    }
    const a = new THREE.Vector3(), b = new THREE.Vector3(), x = new THREE.Vector3(1, 0, 0);
    for (let k = 0; k + 1 < run.count; ++k) {
      if (run.held(run.coupler.broken, m, k) > 0.5) continue;
      a.set(-0.5 * run.cars[k].length, 0, marks.drawbar_height).applyMatrix4(this.poses[k].matrix);
      b.set(0.5 * run.cars[k + 1].length, 0, marks.drawbar_height).applyMatrix4(this.poses[k + 1].matrix);
      const length = a.distanceTo(b);
      turn.setFromUnitVectors(x, a.clone().sub(b).normalize());
      local.compose(a.add(b).multiplyScalar(0.5), turn, size.set(length, marks.drawbar[0], marks.drawbar[1]));
      this.bars.add(local, run.forceColour(run.forceClass(run.held(run.coupler.axial_force, m, k))));
    }
    for (const touch of run.touches) {
      const age = (time - touch.time) / marks.flash;
      if (age < 0 || age >= 1) continue;
      const r = touch.radius * (1 - marks.star_fade * age);
      this.stars.add(local.compose(place.set(touch.x, touch.y, touch.z), none, size.set(r, r, r)));
    }
    for (const c of collections) c.finish();
    this.cell.needsUpdate = true;
  }
  render() {
    if (!this.dirty) return false;
    this.dirty = false;
    this.place();
    this.renderer.render(this.scene, this.camera);
    loaded(this.figure);
    this.pointNorth();
    return true;
  }
  // The arrow in the corner, as one looks at the ground.
  pointNorth() {
    const {north} = this.run.track;
    if (!north) return;
    const look = this.camera.getWorldDirection(new THREE.Vector3()), right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    // From above the view has no direction on the ground but that of its upper edge.
    const up = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    const ahead = Math.hypot(look.x, look.y) > 0.5 ? look : up, length = Math.hypot(ahead.x, ahead.y) || 1;
    const turn = Math.atan2(north[0] * right.x + north[1] * right.y, (north[0] * ahead.x + north[1] * ahead.y) / length) * 180 / Math.PI;
    const box = this.figure.querySelector('.north');
    box.hidden = false;
    box.querySelector('g').setAttribute('transform', `rotate(${turn.toFixed(1)})`);
  }
  // Fewer pixels where the machine does not keep up while it plays; all of them when it stands. `interval`: wall time since the frame
  // before [ms].
  keepUp(interval) {
    this.slow = interval > FRAME_MOST ? this.slow + interval : Math.max(0, this.slow - interval);
    const ratio = this.renderer.getPixelRatio();
    if (this.slow < SLOW_MOST || ratio <= 0.5) return;
    this.slow = 0;
    this.setSharpness(Math.max(0.5, 0.75 * ratio));
  }
  setSharpness(ratio) {
    if (ratio === this.renderer.getPixelRatio()) return;
    this.renderer.setPixelRatio(ratio);
    this.dirty = true;
  }
  legend() {
    const {run} = this, {lies} = this.app, box = this.figure.querySelector('.legend'), used = new Set(lies ? run.lie : run.look);
    box.textContent = '';
    const add = (colour, words, bars = 0) => {
      const span = document.createElement('span'), sign = document.createElement('i');
      sign.style.background = bars === 0 ? colour : `repeating-linear-gradient(90deg, ${colour} 0 3px, ${css(run.marks.ink)} 3px 5px)`;
      span.append(sign, words);
      box.append(span);
    };
    (lies ? run.lies : run.looks).forEach((look, k) => { if (used.has(k)) add(css(look.colour), look.words, look.bars); });
    const steps = run.forces.steps.length, {unit} = run.coupler.axial_force.field;
    if (run.count > 1) {
      add(css(run.forceColour(-steps + 1)), 'draft');
      add(css(run.forceColour(steps - 1)), `buff (arrows and couplers: from ${shown(run.forces.steps[0], unit)})`);
      if (run.coupler.broken.values.some(v => v > 0)) add(css(run.marks.broken), 'coupler broken');
    }
    if (run.touches.length > 0) add(css(run.marks.star), 'cars touch (the time line: each that is faster than all before)');
  }
}

// There is a frame to see, or there will be none.
function loaded(within) { within.querySelectorAll('.loading').forEach(text => text.remove()); }

// ---- The page ----------------------------------------------------------------------------------------------------

const $ = id => document.getElementById(id);
// Wall milliseconds between two drawings of the charts at least.
const CHARTS_EVERY = 120;
class App {
  constructor(runs) {
    Object.assign(this, {runs, time: 0, playing: false, speed: 1, view: 'wreck', picked: null, active: 0, lies: false, frames: 0, asleep: true});
    this.end = Math.max(...runs.map(r => r.end));
    this.scenes = [];
    try {
      runs.forEach((run, i) => {
        const scene = new Scene(document.querySelectorAll('.scene')[i], run, i, this);
        this.scenes.push(scene);
        scene.legend();
      });
    } catch (e) {
      this.complain(`The scene cannot be drawn (${e.message}): it needs WebGL. Charts and tables work without.`);
      document.querySelectorAll('.scene').forEach(s => { s.hidden = true; });
    }
    const {run} = this;
    this.along = new Chart($('along'), $('along-readout'), {readoutFor: x => this.sayAlong(x), pick: x => this.pick(Math.round(x) - 1, this.active)});
    this.largest = new Chart($('largest'), $('largest-readout'), {readoutFor: x => this.sayLargest(x), pick: x => this.seek(x)});
    this.overTime = new Chart($('over-time'), $('over-time-readout'), {readoutFor: x => this.sayOverTime(x), pick: x => this.seek(x)});
    $('time').max = this.end;
    this.listen();
    this.prepare();
    // The wreck is what people want to see first.
    this.seek(this.end);
    for (const scene of this.scenes) scene.view(this.view);
    $('car').max = run.count;
  }
  get run() { return this.runs[this.active]; }
  complain(text) { $('problem').textContent = text; $('problem').hidden = false; }
  focusOn(index) {
    if (this.active === index) return;
    this.active = index;
    this.prepare();
    this.seek(this.time);
  }
  // What depends on the run, not on the time.
  prepare() {
    const {run} = this, n = run.count - 1, {times} = run;
    const buff = new Float64Array(times.length), draft = new Float64Array(times.length);
    const {buff_peak: b, draft_peak: d} = run.coupler;
    let most = 0;
    for (let k = 0; k < times.length; ++k) for (let i = 0; i < n; ++i) {
      buff[k] = Math.max(buff[k], b.values[k * n + i] * b.step);
      draft[k] = Math.max(draft[k], d.values[k * n + i] * d.step);
      most = Math.max(most, buff[k], draft[k]);
    }
    this.unit = run.coupler.axial_force.field.unit;
    $('now').style.background = css(run.marks.now);
    const f = v => v / this.unit.per_shown;
    this.peaks = {buff, draft};
    this.lines = [{x: times, y: buff.map(f), ...line(run.lines.buff), name: run.coupler.buff_peak.field.title},
      {x: times, y: draft.map(v => -f(v)), ...line(run.lines.draft), name: run.coupler.draft_peak.field.title}];
    this.most = f(most);
    this.drawEvents();
  }
  wake() {
    if (!this.asleep) return;
    this.asleep = false;
    this.before = null;
    requestAnimationFrame(now => this.tick(now));
  }
  tick(now) {
    if (this.playing) {
      if (this.before !== null) {
        for (const scene of this.scenes) scene.keepUp(now - this.before);
        this.seek(this.time + Math.min(0.25, (now - this.before) / 1000) * this.speed);
      }
      this.before = now;
      if (this.time >= this.end) this.play(false);
    }
    let drawn = false;
    for (const scene of this.scenes) drawn = scene.render() || drawn;
    if (drawn) ++this.frames;
    if (this.playing || drawn) requestAnimationFrame(t => this.tick(t)); else this.asleep = true;
  }
  play(on) {
    if (on && this.time >= this.end) this.seek(0);
    this.playing = on;
    if (!on) for (const scene of this.scenes) scene.setSharpness(scene.sharpness);
    $('play').textContent = on ? 'Pause' : 'Play';
    this.wake();
  }
  seek(t) {
    this.time = Math.min(this.end, Math.max(0, t));
    for (const scene of this.scenes) scene.update(this.time);
    this.showTime();
    this.wake();
  }
  // What is written and drawn beside the scene need not follow every frame; the last one counts.
  showTime() {
    const wait = (this.chartsDrawn || -CHARTS_EVERY) + CHARTS_EVERY - performance.now();
    if (wait > 0) {
      if (!this.chartsLater) this.chartsLater = setTimeout(() => { this.chartsLater = null; this.showTime(); }, wait);
      return;
    }
    this.chartsDrawn = performance.now();
    $('time').value = this.time;
    $('clock').textContent = `${this.time.toFixed(2)} s`;
    this.drawHead();
    this.drawCharts();
  }
  drawCharts() {
    const {run, unit} = this, m = run.moment(Math.min(this.time, run.end)), n = run.count - 1, x = [], y = [], colours = [], now = css(run.marks.now);
    for (let i = 0; i < n; ++i) {
      const force = run.held(run.coupler.axial_force, m, i);
      x.push(i + 1);
      y.push(force / unit.per_shown);
      const k = run.forceClass(force);
      colours.push(css(run.forceColour(k === 0 ? Math.sign(force) : k)));
    }
    const yTitle = `${run.coupler.axial_force.field.title} (${unit.shown}), buff positive`;
    this.along.set({step: 1, x0: 0.5, x1: Math.max(1.5, n + 0.5), xTitle: 'coupler, counted from the front', yTitle, bars: {x, y, colours}, yRange: [-0.3 * this.most, 0.6 * this.most]});
    this.along.mark(this.picked === null ? undefined : this.picked + 1, now);
    // What does not change with the time is drawn once.
    if (this.largest.spec === undefined || this.largest.spec.lines !== this.lines) this.largest.set({x0: 0, x1: Math.max(run.end, 1e-3), xTitle: 'time (s)', yTitle: unit.shown, lines: this.lines});
    this.largest.mark(Math.min(this.time, run.end), now);
    this.showPicked(m);
  }
  sayAlong(x) {
    const {run, unit} = this, i = Math.min(run.count - 2, Math.max(0, Math.round(x) - 1)), m = run.moment(Math.min(this.time, run.end));
    if (run.count < 2) return '';
    if (run.held(run.coupler.broken, m, i) > 0.5) return `coupler ${i + 1}: broken`;
    const force = run.held(run.coupler.axial_force, m, i);
    return `coupler ${i + 1} at ${this.time.toFixed(2)} s: ${shown(force, unit)} (${inSi(force, unit)})`;
  }
  sayLargest(x) {
    const {run, unit} = this, {at} = run.moment(x), b = this.peaks.buff[at], d = this.peaks.draft[at];
    return `${run.times[at].toFixed(2)} s: buff ${shown(b, unit)} (${inSi(b, unit)}), draft ${shown(d, unit)} (${inSi(d, unit)})`;
  }
  sayOverTime(x) {
    const {run, unit} = this, m = run.moment(x), of = i => {
      const force = run.held(run.coupler.axial_force, {at: m.at}, i);
      return `coupler ${i + 1}: ${shown(force, unit)} (${inSi(force, unit)})`;
    };
    return `${run.times[m.at].toFixed(2)} s; ${this.couplersOf(this.picked).map(of).join('; ')}`;
  }
  couplersOf(car) { return [car - 1, car].filter(i => i >= 0 && i < this.run.count - 1); }
  showPicked(m) {
    const {run, unit, picked} = this;
    const there = picked !== null && picked < run.count;
    $('picked').hidden = !there;
    if (!there) return;
    const car = run.cars[picked], look = run.looks[run.lookOf(m, picked)], lie = run.lieOf(m, picked);
    $('picked-title').textContent = `Car ${picked + 1}: ${car.body.replace(/_/g, ' ')}, ${look.words}${lie > 0 ? `, ${run.lies[lie].words}` : ''}`;
    const rows = [['length', shown(car.length, run.car_units.length), inSi(car.length, run.car_units.length)],
      ['weight', shown(car.weight, run.car_units.weight), inSi(car.weight, run.car_units.weight)]];
    for (const {field} of Object.values(run.car)) {
      if (field.title === '') continue;
      const value = run.held(run.car[field.name], m, picked);
      rows.push([field.title, shown(value, field.unit), inSi(value, field.unit), field.meaning]);
    }
    for (const i of this.couplersOf(picked)) {
      const force = run.held(run.coupler.axial_force, m, i);
      rows.push([`${run.coupler.axial_force.field.title}, coupler ${i + 1}`, run.held(run.coupler.broken, m, i) > 0.5 ? run.coupler.broken.field.title : shown(force, unit), inSi(force, unit), run.coupler.axial_force.field.meaning]);
    }
    const body = $('picked-table').tBodies[0];
    while (body.rows.length > rows.length) body.deleteRow(-1);
    rows.forEach((row, k) => {
      const tr = body.rows[k] || body.insertRow();
      while (tr.cells.length < 3) tr.insertCell().className = tr.cells.length > 1 ? 'n' : '';
      tr.title = row[3] || '';
      for (let j = 0; j < 3; ++j) if (tr.cells[j].textContent !== row[j]) tr.cells[j].textContent = row[j];
    });
    const n = run.count - 1, looks = [line(run.lines.first), line(run.lines.second)];
    if (!this.pickedLines || this.pickedLines.of !== picked || this.pickedLines.run !== this.active) {
      const channel = run.coupler.axial_force;
      const lines = this.couplersOf(picked).map((i, k) => ({...looks[k], name: `coupler ${i + 1}`, x: run.times,
        y: Float64Array.from(run.times, (_, t) => channel.values[t * n + i] * channel.step / unit.per_shown)}));
      this.pickedLines = {of: picked, run: this.active, lines};
    }
    if (this.overTime.spec === undefined || this.overTime.spec.lines !== this.pickedLines.lines) this.overTime.set({x0: 0, x1: Math.max(run.end, 1e-3), xTitle: 'time (s)', yTitle: unit.shown, lines: this.pickedLines.lines});
    this.overTime.mark(Math.min(this.time, run.end), css(run.marks.now));
  }
  pick(car, index) {
    this.focusOn(index);
    this.picked = car === null || Number.isNaN(car) ? null : Math.min(this.run.count - 1, Math.max(0, car));
    $('car').value = this.picked === null ? '' : this.picked + 1;
    if (this.view === 'follow') this.setView('follow');
    this.chartsDrawn = null;
    this.seek(this.time);
  }
  setView(name) {
    this.view = name;
    for (const button of document.querySelectorAll('[data-view]')) button.setAttribute('aria-pressed', button.dataset.view === name);
    for (const scene of this.scenes) scene.view(name);
    this.wake();
  }
  // Colours and bars of the cars: how they lie, else what has made them leave the track.
  showLies(on) {
    this.lies = on;
    $('lies').checked = on;
    for (const scene of this.scenes) scene.legend();
    this.seek(this.time);
  }
  // Ticks of events, one row a kind.
  drawEvents() {
    const shown = $('events'), ratio = window.devicePixelRatio || 1, width = shown.clientWidth;
    if (width === 0) return;
    const kinds = [...new Set(this.run.events.map(e => e.kind))].filter(k => k !== 'end');
    const height = 2 + 15 * Math.max(1, kinds.length);
    shown.style.height = `${height}px`;
    shown.width = Math.round(width * ratio);
    shown.height = Math.round(height * ratio);
    const c = pen(shown);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.ticks = [];
    c.font = '11px system-ui, sans-serif';
    c.textBaseline = 'middle';
    const row = (height - 2) / Math.max(1, kinds.length);
    kinds.forEach((kind, k) => {
      c.fillStyle = k % 2 ? '#f2f4f7' : '#e8ebf0';
      c.fillRect(0, k * row, width, row);
    });
    for (const event of this.run.events) {
      const k = kinds.indexOf(event.kind);
      if (k < 0) continue;
      const x = this.xOf(event.time);
      // Light ones have a rim, as stars and cars have.
      const colour = this.eventColour(event), light = colour[0] + colour[1] > 400;
      c.fillStyle = css(light ? this.run.marks.ink : colour);
      c.fillRect(x - 1, k * row + 1, light ? 4 : 2.5, row - 2);
      c.fillStyle = css(colour);
      c.fillRect(x - 0.25, k * row + 1.75, light ? 2.5 : 1.75, row - 3.5);
      this.ticks.push({x, y: (k + 0.5) * row, event});
    }
    kinds.forEach((kind, k) => {
      const w = c.measureText(kind).width;
      c.fillStyle = 'rgba(255,255,255,0.8)';
      c.fillRect(width - w - 8, k * row + 1, w + 8, row - 2);
      c.fillStyle = '#1a1c20';
      c.fillText(kind, width - w - 4, (k + 0.5) * row);
    });
    this.drawHead();
  }
  // A car that derails has the colour that it has in the scene from then on.
  eventColour(event) {
    const {run} = this;
    if (event.kind !== 'car derailed') return run.event_colours[event.kind];
    return run.looks[run.lookOf({at: run.moment(event.time).next}, event.car - 1)].colour;
  }
  // As the slider has it: its knob is 16 px wide.
  xOf(t) { return 8 + t / this.end * ($('events').clientWidth - 16); }
  // The line at the moment that is shown: nothing else of the time line changes with it.
  drawHead() { $('now').style.transform = `translateX(${this.xOf(this.time) - 1}px)`; }
  nearest(e) {
    const box = $('events').getBoundingClientRect(), x = e.clientX - box.left, y = e.clientY - box.top;
    let best = null, least = 14;
    for (const tick of this.ticks || []) {
      const d = Math.abs(tick.x - x) + 0.25 * Math.abs(tick.y - y);
      if (d < least) { least = d; best = tick.event; }
    }
    return best;
  }
  goTo(event, index) {
    this.focusOn(index);
    this.play(false);
    const car = event.car || event.coupler;
    this.picked = car ? car - 1 : this.picked;
    $('car').value = this.picked === null ? '' : this.picked + 1;
    this.chartsDrawn = null;
    this.seek(event.time);
    $('event').textContent = `${event.time.toFixed(2)} s: ${event.text}`;
    document.querySelectorAll('.events tr.now').forEach(r => r.classList.remove('now'));
    const row = document.querySelector(`.events[data-run="${index}"] tr[data-event="${this.run.events.indexOf(event)}"]`);
    if (row) row.classList.add('now');
  }
  listen() {
    $('play').addEventListener('click', () => this.play(!this.playing));
    $('speed').addEventListener('change', e => { this.speed = parseFloat(e.target.value); });
    $('time').addEventListener('input', e => { this.play(false); this.seek(parseFloat(e.target.value)); });
    $('car').addEventListener('change', e => this.pick(e.target.value === '' ? null : parseInt(e.target.value, 10) - 1, this.active));
    for (const button of document.querySelectorAll('[data-view]')) button.addEventListener('click', () => this.setView(button.dataset.view));
    const events = $('events');
    events.addEventListener('pointermove', e => { const near = this.nearest(e); $('event').textContent = near ? `${near.time.toFixed(2)} s: ${near.text}` : '\u00a0'; });
    events.addEventListener('click', e => {
      const near = this.nearest(e), box = events.getBoundingClientRect();
      if (near) this.goTo(near, this.active); else this.seek((e.clientX - box.left - 8) / Math.max(1, box.width - 16) * this.end);
    });
    $('lies').addEventListener('change', e => this.showLies(e.target.checked));
    new ResizeObserver(() => this.drawEvents()).observe(events);
    for (const table of document.querySelectorAll('table.events')) {
      const index = parseInt(table.dataset.run, 10);
      table.tBodies[0].addEventListener('click', e => {
        const row = e.target.closest('tr');
        this.goTo(this.runs[index].events[row.dataset.event], index);
      });
    }
    document.addEventListener('keydown', e => this.key(e));
    window.addEventListener('beforeprint', () => {
      for (const scene of this.scenes) {
        scene.dirty = true;
        scene.render();
        scene.figure.querySelector('.printed').src = scene.canvas.toDataURL();
      }
    });
  }
  key(e) {
    // Whatever has the focus has its own keys first.
    if (e.defaultPrevented || e.ctrlKey || e.altKey || e.metaKey) return;
    const {tagName, type} = e.target, tick = tagName === 'INPUT' && type === 'checkbox';
    if (/^(SELECT|TEXTAREA)$/.test(tagName) || (tagName === 'INPUT' && !tick && type !== 'range')) return;
    if (type === 'range' && /^(Arrow|Home|End|Page)/.test(e.key)) return;
    if ((e.key === ' ' || e.key === 'Enter') && (tick || /^(BUTTON|SUMMARY|TH|A)$/.test(tagName))) return;
    const byEvent = way => {
      const times = this.run.events.filter(v => way > 0 ? v.time > this.time + 1e-6 : v.time < this.time - 1e-6);
      if (times.length > 0) this.goTo(times.reduce((a, b) => way * (b.time - a.time) < 0 ? b : a), this.active);
    };
    const faster = way => {
      const options = $('speed');
      options.selectedIndex = Math.min(options.length - 1, Math.max(0, options.selectedIndex + way));
      this.speed = parseFloat(options.value);
    };
    const next = way => this.pick(this.picked === null ? (way > 0 ? 0 : this.run.count - 1) : this.picked + way, this.active);
    const actions = {
      ' ': () => this.play(!this.playing),
      ArrowLeft: () => this.seek(this.time - (e.shiftKey ? 1 : 0.1)),
      ArrowRight: () => this.seek(this.time + (e.shiftKey ? 1 : 0.1)),
      Home: () => this.seek(0), End: () => this.seek(this.end),
      ',': () => byEvent(-1), '.': () => byEvent(1),
      '+': () => faster(1), '-': () => faster(-1),
      n: () => next(1), p: () => next(-1), Escape: () => this.pick(null, this.active),
      w: () => this.setView('wreck'), a: () => this.setView('above'), t: () => this.setView('train'), f: () => this.setView('follow'),
      l: () => this.showLies(!this.lies),
    };
    if (!actions[e.key]) return;
    e.preventDefault();
    actions[e.key]();
  }
  // For tests and for the console: where a car is now, in the world [m], [rad].
  carNow(i) {
    const {run} = this, m = run.moment(Math.min(this.time, run.end)), values = {look: run.looks[run.lookOf(m, i)].words, lie: run.lies[run.lieOf(m, i)].words};
    for (const name of Object.keys(run.car)) values[name] = run.value(run.car[name], m, i);
    return values;
  }
}

(async () => {
  try {
    if (typeof DecompressionStream === 'undefined') throw new Error('this browser is from before 2023');
    const runs = [];
    for (const script of document.querySelectorAll('script.run')) runs.push(await Run.read(script.textContent.trim()));
    window.replay = new App(runs);
    document.documentElement.dataset.ready = String(Math.round(performance.now()));
  } catch (e) {
    $('problem').textContent = `The scene and the charts cannot be shown: ${e.message}. The tables below are whole.`;
    $('problem').hidden = false;
    loaded(document);
    throw e;
  }
})();
