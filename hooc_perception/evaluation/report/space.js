// 3D views of a report: measured points, posed models, cameras, the table. One renderer of
// three.js serves all scenes, since browsers allow few of them: it draws where nobody looks, and
// the picture is copied to the scene's own canvas.
(() => {
'use strict';
const BACKGROUND = 0x262a33, TABLE = 0x8a909a, PICKED = 0x2e80ff;
const CAMERAS = [0xf2c14e, 0x5fc9e8, 0xe58bd0, 0x9ad36a];
// Colours of the page are shown as they are.
THREE.ColorManagement.enabled = false;

const makeRenderer = () => {
  try {
    const made = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
    made.outputColorSpace = THREE.LinearSRGBColorSpace;
    made.setClearColor(BACKGROUND);
    return made;
  } catch (error) {
    return null;
  }
};
const renderer = makeRenderer();
const views = [];

const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
const shorts = text => new Uint16Array(bytes(text).buffer);
const label = o => o.name.replace(/_/g, ' ') + (o.id === null ? '' : ` ${o.id}`);

// ---- what scenes share

const meshes = JSON.parse(document.getElementById('space-meshes').textContent);
const known = {};

// The mesh of a name in its own frame, and the edges of its box.
const shape = name => {
  if (known[name]) return known[name];
  const mesh = meshes[name], solid = new THREE.BufferGeometry();
  const place = (x, i) => (x / 65535 - 0.5) * mesh.extents[i % 3];
  solid.setAttribute('position', new THREE.BufferAttribute(
    Float32Array.from(shorts(mesh.v), place), 3));
  solid.setIndex(new THREE.BufferAttribute(
    mesh.wide ? new Uint32Array(bytes(mesh.f).buffer) : shorts(mesh.f), 1));
  const box = new THREE.EdgesGeometry(new THREE.BoxGeometry(...mesh.extents));
  return known[name] = {solid, box};
};

const lines = (geometry, color) => new THREE.LineSegments(
  geometry, new THREE.LineBasicMaterial({color}));

const posed = (object, at) => {
  const [a, b, c, d, e, f, g, h, i, x, y, z] = at;
  object.matrixAutoUpdate = false;
  object.matrix.set(a, d, g, x, b, e, h, y, c, f, i, z, 0, 0, 0, 1);
  return object;
};

const clear = group => {
  group.children.forEach(part => {
    part.material.dispose();
    if (part.userData.own) part.geometry.dispose();
  });
  group.clear();
};

// ---- one scene, or the frame sets of a sequence

class Space {
  constructor(box) {
    this.box = box;
    this.canvas = box.querySelector('canvas');
    this.panel = box.querySelector('.facts');
    this.article = box.closest('.scene');
    this.data = JSON.parse(box.querySelector('script').textContent);
    this.picked = null;
    this.scene = new THREE.Scene();
    this.parts = {models: new THREE.Group(), truth: new THREE.Group(), table: new THREE.Group(),
      cameras: new THREE.Group()};
    this.cloud = new THREE.Group();
    this.boxes = new THREE.Group();
    this.scene.add(...Object.values(this.parts), this.cloud, this.boxes);
    this.addTable();
    this.build(Number(box.dataset.step || 0));
    this.light();
    this.steer();
    this.toggles = [...box.querySelectorAll('input')];
    this.toggles.forEach(input => input.addEventListener('change', () => this.draw()));
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.reset();
  }

  // What a frame set shows takes the place of what was shown.
  build(index) {
    this.step = this.data.steps[index];
    const {models, truth, cameras} = this.parts;
    [models, truth, cameras, this.cloud, this.boxes].forEach(clear);
    this.objects = this.step.objects.map((o, k) => ({...o, k, middle: o.at.slice(9),
      solid: this.addModel(o), box: this.addBox(o)}));
    this.step.truth.forEach(o => truth.add(posed(new THREE.Mesh(
      shape(o.mesh).solid, this.glass(0xffffff, 0.45)), o.at)));
    this.addPoints();
    this.step.cameras.forEach((camera, k) => this.addCamera(camera, k));
  }

  // Show the frame set of a number from 0 on; an object with an id stays picked.
  show(index) {
    const id = this.picked === null ? null : this.objects[this.picked].id;
    this.build(index);
    const k = id === null ? -1 : this.objects.findIndex(o => o.id === id);
    this.pick(k < 0 ? null : k);
  }

  // Transparent things do not hide what is in them.
  glass(color, opacity) {
    return new THREE.MeshLambertMaterial({color, opacity, transparent: true, depthWrite: false,
      flatShading: true, side: THREE.DoubleSide});
  }

  addModel(o) {
    const color = `rgb(${o.colour})`, {solid, box} = shape(o.mesh);
    const material = o.unknown ? this.glass(color, 0.4) : new THREE.MeshLambertMaterial(
      {color, flatShading: true, side: THREE.DoubleSide});
    const made = posed(new THREE.Mesh(solid, material), o.at);
    this.parts.models.add(made);
    if (o.unknown) this.parts.models.add(posed(lines(box, color), o.at));
    return made;
  }

  addBox(o) {
    const made = posed(lines(shape(o.mesh).box, PICKED), o.at);
    made.visible = false;
    this.boxes.add(made);
    return made;
  }

  addPoints() {
    const {groups, low, span, p, rgb} = this.step.cloud, colours = bytes(rgb);
    const places = Float32Array.from(shorts(p), (x, i) => low[i % 3] + span[i % 3] * x / 65535);
    let first = 0;
    this.points = groups.map(({camera, kind, n}) => {
      const part = [3 * first, 3 * (first += n)], geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(places.slice(...part), 3));
      geometry.setAttribute('color', new THREE.BufferAttribute(
        colours.slice(...part), 3, true));
      const made = new THREE.Points(geometry, new THREE.PointsMaterial({vertexColors: true,
        size: this.distance() * (kind === 'unexplained' ? 0.009 : 0.006)}));
      made.userData.own = true;
      this.cloud.add(made);
      return {camera, kind, made};
    });
  }

  addTable() {
    const {low, high, z} = this.data.table;
    const plane = new THREE.PlaneGeometry(high[0] - low[0], high[1] - low[1]);
    const top = new THREE.Mesh(plane, new THREE.MeshBasicMaterial({color: TABLE, opacity: 0.28,
      transparent: true, depthWrite: false, side: THREE.DoubleSide}));
    this.parts.table.add(top, lines(new THREE.EdgesGeometry(plane), TABLE));
    this.parts.table.position.set((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, z);
  }

  addCamera(camera, k) {
    const p = camera.frustum, ends = [];
    for (let i = 1; i < 5; i++) ends.push(p[0], p[i], p[i], p[i % 4 + 1]);
    const geometry = new THREE.BufferGeometry().setAttribute(
      'position', new THREE.BufferAttribute(new Float32Array(ends.flat()), 3));
    const made = lines(geometry, CAMERAS[k % CAMERAS.length]);
    made.userData.own = true;
    this.parts.cameras.add(made);
  }

  light() {
    const {view} = this.data;
    this.camera = new THREE.PerspectiveCamera(view.field, 16 / 9, view.near, view.far);
    this.camera.up.set(0, 0, 1);
    // The lamp goes with the viewer. Lambert's law divides by pi.
    const lamp = new THREE.DirectionalLight(0xffffff, 0.6 * Math.PI);
    lamp.position.set(0.3, 0.5, 1);
    this.camera.add(lamp, lamp.target);
    this.scene.add(this.camera, new THREE.AmbientLight(0xffffff, 0.42 * Math.PI));
  }

  steer() {
    const {view} = this.data;
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    Object.assign(this.controls, {minDistance: view.nearest, maxDistance: view.farthest,
      maxPolarAngle: 1.77, enableZoom: false});
    // A finger still scrolls the page.
    this.canvas.style.touchAction = 'pan-y';
    this.controls.addEventListener('change', () => this.draw());
  }

  // From the target to the viewer at first, metres.
  distance() {
    const {eye, target} = this.data.view;
    return Math.hypot(...eye.map((x, i) => x - target[i]));
  }

  reset() {
    this.camera.position.set(...this.data.view.eye);
    this.controls.target.set(...this.data.view.target);
    this.controls.update();
    this.draw();
  }

  // Where a world point is on the canvas, CSS pixels.
  project(p) {
    const r = this.canvas.getBoundingClientRect();
    const {x, y} = new THREE.Vector3(...p).project(this.camera);
    return [(x + 1) / 2 * r.width, (1 - y) / 2 * r.height];
  }

  choose() {
    const on = {}, seen = {};
    this.toggles.forEach(input => {
      (input.classList.contains('camera') ? seen : on)[input.name] = input.checked;
    });
    for (const [name, part] of Object.entries(this.parts)) part.visible = !!on[name];
    for (const {camera, kind, made} of this.points)
      made.visible = on[kind === 'unexplained' ? kind : 'measured'] && seen[camera] !== false;
    this.objects.forEach(o => {
      o.box.visible = o.k === this.picked;
      if (!o.unknown) o.solid.material.emissive.setHex(o.k === this.picked ? 0x404040 : 0);
    });
    return on;
  }

  draw() {
    const scale = Math.min(devicePixelRatio || 1, 2), r = this.canvas.getBoundingClientRect();
    if (!r.width || !r.height || renderer.getContext().isContextLost()) return;
    const [w, h] = [Math.round(r.width * scale), Math.round(r.height * scale)];
    if (this.canvas.width !== w || this.canvas.height !== h)
      [this.canvas.width, this.canvas.height] = [w, h];
    renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    const on = this.choose(), context = this.canvas.getContext('2d');
    renderer.render(this.scene, this.camera);
    context.drawImage(renderer.domElement, 0, 0);
    if (on.names) this.objects.forEach(o => this.write(context, scale, o.middle, label(o),
      o.k === this.picked ? '#ffffff' : `rgb(${o.colour})`));
    if (on.cameras) this.step.cameras.forEach((c, k) => this.write(context, scale, c.frustum[0],
      c.name, `#${CAMERAS[k % CAMERAS.length].toString(16)}`));
  }

  write(context, scale, place, text, colour) {
    if (new THREE.Vector3(...place).applyMatrix4(this.camera.matrixWorldInverse).z > 0) return;
    const [x, y] = this.project(place).map(c => c * scale);
    Object.assign(context, {font: `600 ${12 * scale}px system-ui, sans-serif`, lineWidth: 3 * scale,
      textAlign: 'center', strokeStyle: '#0b0e13cc', fillStyle: colour});
    context.strokeText(text, x, y);
    context.fillText(text, x, y);
  }

  // The object at a place of the canvas (CSS pixels), null for none.
  at(x, y) {
    const r = this.canvas.getBoundingClientRect(), caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2(2 * x / r.width - 1, 1 - 2 * y / r.height),
      this.camera);
    const [first] = caster.intersectObjects(this.objects.map(o => o.solid), false);
    return first ? this.objects.find(o => o.solid === first.object).k : null;
  }

  pick(k) {
    this.picked = k;
    this.panel.replaceChildren();
    this.panel.hidden = k === null;
    if (k !== null) {
      const o = this.objects[k], title = document.createElement('b');
      title.textContent = label(o);
      const list = document.createElement('dl');
      for (const [label, text] of o.facts) {
        list.append(Object.assign(document.createElement('dt'), {textContent: label}),
          Object.assign(document.createElement('dd'), {textContent: text}));
      }
      this.panel.append(title, list);
    }
    this.article.querySelectorAll('tr[data-k]').forEach(
      row => row.classList.toggle('picked', k !== null && row.dataset.k === String(k)));
    this.draw();
  }

  listen() {
    const {canvas, controls} = this;
    let start = null;
    canvas.addEventListener('pointerdown', e => {
      start = [e.clientX, e.clientY];
      canvas.focus({preventScroll: true});
    });
    canvas.addEventListener('pointerup', e => {
      if (start && Math.hypot(e.clientX - start[0], e.clientY - start[1]) < 5)
        this.pick(this.at(e.offsetX, e.offsetY));
      start = null;
    });
    // The page scrolls on until the view was clicked.
    canvas.addEventListener('focus', () => { controls.enableZoom = true; });
    canvas.addEventListener('blur', () => { controls.enableZoom = false; });
    canvas.addEventListener('dblclick', () => this.reset());
    const keys = {ArrowLeft: () => controls.rotateLeft(0.1),
      ArrowRight: () => controls.rotateLeft(-0.1), ArrowUp: () => controls.rotateUp(0.1),
      ArrowDown: () => controls.rotateUp(-0.1), '+': () => controls.dollyIn(0.9),
      '-': () => controls.dollyOut(0.9), Escape: () => this.pick(null)};
    // In a sequence, these go to the next frame set.
    if (this.data.steps.length > 1) ['ArrowLeft', 'ArrowRight'].forEach(key => delete keys[key]);
    canvas.addEventListener('keydown', e => {
      if (keys[e.key]) { e.preventDefault(); keys[e.key](); }
    });
    this.article.querySelectorAll('tr[data-k]').forEach(row => {
      if (row.dataset.k !== '-1')
        row.addEventListener('click', () => this.pick(Number(row.dataset.k)));
    });
  }
}

// Without WebGL, the still picture below the canvas remains.
const still = box => {
  box.querySelector('.hint').textContent = 'This browser offers no WebGL, so the 3D view cannot ' +
    'be turned: the picture is a still. Switch on hardware acceleration, or use another browser.';
  box.querySelectorAll('input').forEach(input => { input.disabled = true; });
  box.querySelector('canvas').hidden = true;
};

document.querySelectorAll('.space').forEach(box => {
  if (!renderer) return still(box);
  // Scenes that nobody has scrolled to cost nothing.
  const watch = new IntersectionObserver(seen => {
    if (!seen.some(s => s.isIntersecting)) return;
    watch.disconnect();
    views.push(box.view = new Space(box));
  }, {rootMargin: '200px'});
  watch.observe(box);
});
if (renderer) renderer.domElement.addEventListener(
  'webglcontextrestored', () => views.forEach(view => view.draw()));
})();
