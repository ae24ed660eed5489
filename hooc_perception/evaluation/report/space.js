// 3D views of a report: measured points, posed models. One WebGL context serves all scenes:
// it draws where nobody looks, and the picture is copied to the scene's own canvas.
(() => {
'use strict';
const FIELD = 0.62, NEAR = 0.02, FAR = 20;
const gl = document.createElement('canvas').getContext('webgl', {antialias: true, alpha: false});

const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
const shorts = text => new Uint16Array(bytes(text).buffer);
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };

// ---- compiled once

const program = (vertex, fragment) => {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw Error(gl.getProgramInfoLog(made));
  return made;
};
const dots = gl && program(
  'attribute vec3 p; attribute vec3 rgb; uniform mat4 m; uniform vec3 low, span;' +
  'uniform float size; varying vec3 c; void main() { gl_Position = m * vec4(low + p * span, 1.);' +
  'gl_PointSize = clamp(size / gl_Position.w, 1.5, 9.); c = rgb; }',
  'precision mediump float; varying vec3 c; void main() { gl_FragColor = vec4(c, 1.); }');
const solid = gl && program(
  'attribute vec3 p, n; uniform mat4 m; uniform vec3 eye; varying float light;' +
  'void main() { gl_Position = m * vec4(p, 1.);' +
  'light = length(n) > 0. ? .38 + .5 * abs(dot(n, normalize(eye - p))) + .12 * n.z : 1.; }',
  'precision mediump float; uniform vec4 rgba; varying float light;' +
  'void main() { gl_FragColor = vec4(rgba.rgb * light, rgba.a); }');

const buffer = data => {
  const made = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  return made;
};
const attribute = (where, name, made, kind, normal, stride, offset) => {
  const at = gl.getAttribLocation(where, name);
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.enableVertexAttribArray(at);
  gl.vertexAttribPointer(at, 3, kind, normal, stride, offset);
};
const uniform = (where, name) => gl.getUniformLocation(where, name);

// ---- data

const meshes = JSON.parse(document.getElementById('space-meshes').textContent);

// World triangles (9 numbers each) and box corners of an object.
const posed = thing => {
  const mesh = meshes[thing.mesh], a = thing.at;
  const place = v => [0, 1, 2].map(i => a[i] * v[0] + a[3 + i] * v[1] + a[6 + i] * v[2] + a[9 + i]);
  const raw = shorts(mesh.v);
  const faces = mesh.wide ? new Uint32Array(bytes(mesh.f).buffer) : shorts(mesh.f);
  const corner = i => place([0, 1, 2].map(k => (raw[3 * i + k] / 65535 - 0.5) * mesh.extents[k]));
  const triangles = new Float32Array(3 * faces.length);
  const known = Array.from({length: raw.length / 3}, (_, i) => corner(i));
  faces.forEach((v, i) => triangles.set(known[v], 3 * i));
  const half = mesh.extents.map(x => x / 2), ends = [];
  for (let i = 0; i < 8; i++)
    for (let k = 0; k < 3; k++)
      if (!(i >> k & 1)) ends.push(i, i | 1 << k);
  const box = new Float32Array(ends.flatMap(
    i => place(half.map((h, k) => i >> k & 1 ? h : -h)).concat(0, 0, 0)));
  return {triangles, box, middle: place([0, 0, 0])};
};

// Interleaved positions and face normals.
const lit = triangles => {
  const out = new Float32Array(2 * triangles.length);
  for (let t = 0; t < triangles.length; t += 9) {
    const v = [0, 3, 6].map(k => Array.from(triangles.subarray(t + k, t + k + 3)));
    const n = unit(cross(sub(v[1], v[0]), sub(v[2], v[0])));
    v.forEach((p, k) => out.set(p.concat(n), 2 * t + 6 * k));
  }
  return out;
};

// Distance along a ray to the nearest triangle, Infinity for none (Moeller and Trumbore).
const hit = (triangles, from, ray) => {
  let best = Infinity;
  for (let t = 0; t < triangles.length; t += 9) {
    const a = triangles.subarray(t, t + 3);
    const e1 = sub(triangles.subarray(t + 3, t + 6), a);
    const e2 = sub(triangles.subarray(t + 6, t + 9), a);
    const h = cross(ray, e2), d = dot(e1, h);
    if (Math.abs(d) < 1e-14) continue;
    const s = sub(from, a), u = dot(s, h) / d;
    if (u < 0 || u > 1) continue;
    const q = cross(s, e1), v = dot(ray, q) / d;
    if (v < 0 || u + v > 1) continue;
    const along = dot(e2, q) / d;
    if (along > 0 && along < best) best = along;
  }
  return best;
};

// ---- one scene

class Space {
  constructor(box) {
    this.box = box;
    this.canvas = box.querySelector('canvas');
    this.panel = box.querySelector('.facts');
    this.scene = box.closest('.scene');
    this.data = JSON.parse(box.querySelector('script').textContent);
    this.objects = this.data.objects.map(o => ({...o, ...posed(o)}));
    this.truth = this.data.truth.map(o => ({...o, ...posed(o)}));
    this.picked = null;
    this.show = {};
    box.querySelectorAll('input').forEach(input => {
      const read = () => { this.show[input.name] = input.checked; this.draw(); };
      this.show[input.name] = input.checked;
      input.addEventListener('change', read);
    });
    this.upload();
    this.reset();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  upload() {
    const cloud = this.data.cloud;
    this.points = buffer(shorts(cloud.p));
    this.colours = buffer(bytes(cloud.rgb));
    for (const o of [...this.objects, ...this.truth]) {
      o.vertices = buffer(lit(o.triangles));
      o.edges = buffer(o.box);
    }
  }

  reset() {
    const span = this.data.cloud.span;
    this.target = [...this.data.target];
    this.azimuth = this.data.azimuth;
    this.elevation = 0.6;
    this.distance = 0.95 * Math.hypot(...span);
    this.draw();
  }

  // Eye and the axes of the picture: right, up, towards the eye.
  look() {
    const c = Math.cos(this.elevation), back = [c * Math.cos(this.azimuth),
      c * Math.sin(this.azimuth), Math.sin(this.elevation)];
    const right = [-Math.sin(this.azimuth), Math.cos(this.azimuth), 0];
    return {back, right, up: cross(back, right),
      eye: this.target.map((t, i) => t + this.distance * back[i])};
  }

  matrix() {
    const {eye, right, up, back} = this.look(), f = 1 / Math.tan(FIELD / 2);
    const aspect = this.canvas.width / this.canvas.height;
    const row = (axis, s) => [...axis.map(x => s * x), -s * dot(axis, eye)];
    const x = row(right, f / aspect), y = row(up, f), z = row(back, 1);
    const a = (FAR + NEAR) / (NEAR - FAR), b = 2 * FAR * NEAR / (NEAR - FAR);
    return [0, 1, 2, 3].flatMap(k => [x[k], y[k], a * z[k] + (k === 3 ? b : 0), -z[k]]);
  }

  // Where a world point is on the canvas, CSS pixels.
  project(p) {
    const m = this.matrix(), v = [...p, 1];
    const [x, y, , w] = [0, 1, 2, 3].map(i => m[i] * v[0] + m[4 + i] * v[1] + m[8 + i] * v[2] +
      m[12 + i]);
    const r = this.canvas.getBoundingClientRect();
    return [(x / w + 1) / 2 * r.width, (1 - y / w) / 2 * r.height];
  }

  draw() {
    const scale = Math.min(devicePixelRatio || 1, 2), r = this.canvas.getBoundingClientRect();
    if (!r.width) return;
    const [w, h] = [Math.round(r.width * scale), Math.round(r.height * scale)];
    if (this.canvas.width !== w || this.canvas.height !== h)
      [this.canvas.width, this.canvas.height] = [w, h];
    [gl.canvas.width, gl.canvas.height] = [w, h];
    gl.viewport(0, 0, w, h);
    const style = getComputedStyle(this.canvas).backgroundColor.match(/[\d.]+/g).map(Number);
    gl.clearColor(style[0] / 255, style[1] / 255, style[2] / 255, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const m = this.matrix();
    this.drawPoints(m, 0.0032 * h);
    this.drawSolids(m);
    const context = this.canvas.getContext('2d');
    context.drawImage(gl.canvas, 0, 0);
    if (this.show.names) this.drawNames(context, scale);
  }

  drawPoints(m, size) {
    const {n, low, span} = this.data.cloud;
    gl.useProgram(dots);
    gl.uniformMatrix4fv(uniform(dots, 'm'), false, m);
    gl.uniform3fv(uniform(dots, 'low'), low);
    gl.uniform3fv(uniform(dots, 'span'), span);
    attribute(dots, 'p', this.points, gl.UNSIGNED_SHORT, true, 6, 0);
    attribute(dots, 'rgb', this.colours, gl.UNSIGNED_BYTE, true, 3, 0);
    let first = 0;
    ['measured', 'measured', 'unexplained'].forEach((name, k) => {
      gl.uniform1f(uniform(dots, 'size'), size * (k === 2 ? 1.6 : 1));
      if (this.show[name] && n[k]) gl.drawArrays(gl.POINTS, first, n[k]);
      first += n[k];
    });
  }

  drawSolids(m) {
    gl.useProgram(solid);
    gl.uniformMatrix4fv(uniform(solid, 'm'), false, m);
    gl.uniform3fv(uniform(solid, 'eye'), this.look().eye);
    const draw = (made, kind, count, rgba) => {
      attribute(solid, 'p', made, gl.FLOAT, false, 24, 0);
      attribute(solid, 'n', made, gl.FLOAT, false, 24, 12);
      gl.uniform4fv(uniform(solid, 'rgba'), rgba);
      gl.drawArrays(kind, 0, count);
    };
    if (this.show.models) this.objects.forEach((o, k) => {
      const mine = k === this.picked, rgb = o.colour.map(c => c / 255);
      draw(o.vertices, gl.TRIANGLES, o.triangles.length / 3,
        [...rgb.map(c => mine ? 0.75 * c + 0.25 : c), 1]);
    });
    if (this.picked !== null)
      draw(this.objects[this.picked].edges, gl.LINES, 24, [0.18, 0.5, 1, 1]);
    if (!this.show.truth) return;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.truth.forEach(o => draw(o.vertices, gl.TRIANGLES, o.triangles.length / 3,
      [1, 1, 1, 0.45]));
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  drawNames(context, scale) {
    context.font = `600 ${12 * scale}px system-ui, sans-serif`;
    context.textAlign = 'center';
    context.lineWidth = 3 * scale;
    this.objects.forEach((o, k) => {
      const [x, y] = this.project(o.middle).map(c => c * scale);
      context.strokeStyle = '#0b0e13cc';
      context.fillStyle = k === this.picked ? '#ffffff' : `rgb(${o.colour})`;
      context.strokeText(o.name.replace(/_/g, ' '), x, y);
      context.fillText(o.name.replace(/_/g, ' '), x, y);
    });
  }

  // The object at a place of the canvas (CSS pixels), null for none.
  at(x, y) {
    const {eye, right, up, back} = this.look(), r = this.canvas.getBoundingClientRect();
    const t = Math.tan(FIELD / 2), u = (2 * x / r.width - 1) * t * r.width / r.height;
    const v = (1 - 2 * y / r.height) * t;
    const ray = [0, 1, 2].map(i => u * right[i] + v * up[i] - back[i]);
    let best = null, least = Infinity;
    this.objects.forEach((o, k) => {
      const d = hit(o.triangles, eye, ray);
      if (d < least) [best, least] = [k, d];
    });
    return best;
  }

  pick(k) {
    this.picked = k;
    this.panel.replaceChildren();
    this.panel.hidden = k === null;
    if (k !== null) {
      const o = this.objects[k], title = document.createElement('b');
      title.textContent = o.name.replace(/_/g, ' ');
      const list = document.createElement('dl');
      for (const [label, text] of o.facts) {
        list.append(Object.assign(document.createElement('dt'), {textContent: label}),
          Object.assign(document.createElement('dd'), {textContent: text}));
      }
      this.panel.append(title, list);
    }
    this.scene.querySelectorAll('tr[data-k]').forEach(
      row => row.classList.toggle('picked', k !== null && row.dataset.k === String(k)));
    this.draw();
  }

  turn(x, y) {
    this.azimuth -= x;
    this.elevation = Math.min(1.55, Math.max(-0.2, this.elevation + y));
    this.draw();
  }

  move(x, y) {
    const {right, up} = this.look(), height = this.canvas.getBoundingClientRect().height;
    const s = 2 * this.distance * Math.tan(FIELD / 2) / height;
    this.target = this.target.map((t, i) => t + s * (y * up[i] - x * right[i]));
    this.draw();
  }

  zoom(factor) {
    this.distance = Math.min(8, Math.max(0.1, this.distance * factor));
    this.draw();
  }

  listen() {
    const canvas = this.canvas;
    let last = null, way = 0;
    canvas.addEventListener('pointerdown', e => {
      last = [e.clientX, e.clientY];
      way = 0;
      canvas.setPointerCapture(e.pointerId);
      canvas.focus({preventScroll: true});
    });
    canvas.addEventListener('pointermove', e => {
      if (!last) return;
      const [x, y] = [e.clientX - last[0], e.clientY - last[1]];
      last = [e.clientX, e.clientY];
      way += Math.abs(x) + Math.abs(y);
      if (e.shiftKey || e.buttons & 6) this.move(x, y);
      else this.turn(0.008 * x, 0.008 * y);
    });
    canvas.addEventListener('pointerup', e => {
      if (last && way < 5) this.pick(this.at(e.offsetX, e.offsetY));
      last = null;
    });
    canvas.addEventListener('pointercancel', () => { last = null; });
    canvas.addEventListener('contextmenu', e => e.preventDefault());
    // The page scrolls on until the view was clicked.
    canvas.addEventListener('wheel', e => {
      if (document.activeElement !== canvas && !e.ctrlKey) return;
      e.preventDefault();
      this.zoom(Math.exp(0.0015 * e.deltaY));
    }, {passive: false});
    canvas.addEventListener('dblclick', () => this.reset());
    const keys = {ArrowLeft: () => this.turn(0.1, 0), ArrowRight: () => this.turn(-0.1, 0),
      ArrowUp: () => this.turn(0, 0.1), ArrowDown: () => this.turn(0, -0.1),
      '+': () => this.zoom(0.9), '-': () => this.zoom(1.1), Escape: () => this.pick(null)};
    canvas.addEventListener('keydown', e => {
      if (keys[e.key]) { e.preventDefault(); keys[e.key](); }
    });
    this.scene.querySelectorAll('tr[data-k]').forEach(row => {
      if (row.dataset.k !== '-1')
        row.addEventListener('click', () => this.pick(Number(row.dataset.k)));
    });
  }
}

document.querySelectorAll('.space').forEach(box => {
  if (!gl) {
    box.querySelector('.hint').textContent = 'This browser does not draw in 3D (no WebGL).';
    return;
  }
  // Scenes that nobody has scrolled to cost nothing.
  const watch = new IntersectionObserver(seen => {
    if (!seen.some(s => s.isIntersecting)) return;
    watch.disconnect();
    box.view = new Space(box);
  }, {rootMargin: '200px'});
  watch.observe(box);
});
})();
