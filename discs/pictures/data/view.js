"use strict";
// Discs in three dimensions: z is up, the plane is z = 0; d_1 along the axle, the spoke d_3 = cos(theta) e_z + sin(theta) J d_1.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const at = (id) => document.getElementById(id);
  const stage = at("stage"), scrub = at("scrub");
  const R = data.radius;
  const tone = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim(); // a colour of view.css
  const kinds = ["first", "second"];
  const runs = data.runs.map((run) => ({ ...run, ...unpack(run.arrays) }));
  const start = Math.min(...runs.map((run) => run.t[0])), end = Math.max(...runs.map((run) => run.t.at(-1)));

  function unpack(arrays) {
    return Object.fromEntries(Object.entries(arrays).map(([name, text]) => {
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      const view = new DataView(bytes.buffer), values = new Float32Array(bytes.length / 4);
      for (let i = 0; i < values.length; i++) values[i] = view.getFloat32(4 * i, true);
      return [name, values];
    }));
  }

  function largest(values, start) { let m = start; for (const v of values) m = Math.max(m, v); return m; }
  function smallest(values, start) { let m = start; for (const v of values) m = Math.min(m, v); return m; }

  // ---- colour: the same scale for both runs
  const scales = {};
  for (const name of ["theta", "omega", "stretch", "force"]) {
    if (!runs.every((run) => run[name])) continue;
    const signed = name === "theta" || name === "omega";
    let high = Math.max(...runs.map((run) => largest(run[name], -Infinity)));
    let low = Math.min(...runs.map((run) => smallest(run[name], Infinity)));
    if (signed) { high = Math.max(high, -low) || 1; low = -high; }
    if (high - low < 1e-6 * Math.abs(high) + 1e-30) { low -= 0.5; high += 0.5; }
    scales[name] = { low, high, stops: (signed ? data.style.signed : data.style.unsigned).map((c) => new THREE.Color(c)) };
    at("colour").add(new Option(data.label[name], name));
  }
  // at first by the rates, unless all discs are at rest then
  at("colour").value = runs.some((run) => run.omega.subarray(0, run.n).some((value) => value)) ? "omega" : "theta";
  const mixed = new THREE.Color();
  function colour(scale, value) {
    const p = Math.min(Math.max((value - scale.low) / (scale.high - scale.low), 0), 1) * (scale.stops.length - 1);
    const i = Math.min(Math.floor(p), scale.stops.length - 2);
    return mixed.copy(scale.stops[i]).lerp(scale.stops[i + 1], p - i);
  }

  // ---- the stage: one canvas, a strip of it for each run, one camera
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  } catch (error) {
    at("note").textContent = "This browser shows no WebGL, which the discs are drawn with.";
    return;
  }
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.setScissorTest(true);
  renderer.domElement.setAttribute("aria-hidden", "true");
  stage.prepend(renderer.domElement);
  const low = [0, 1].map((j) => Math.min(...runs.map((run) => smallest(j ? run.y : run.x, Infinity))) - 1.1 * R);
  const high = [0, 1].map((j) => Math.max(...runs.map((run) => largest(j ? run.y : run.x, -Infinity))) + 1.1 * R);
  const middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
  const reach = Math.hypot(high[0] - low[0], high[1] - low[1]) / 2;
  const places = runs.flatMap((run) => { // some of the motion, what a view of all of it must show
    const every = Math.ceil(run.x.length / 300), picked = Array.from(run.x.keys()).filter((p) => p % every === 0);
    return picked.flatMap((p) => [-1, 1].flatMap((side) => [[side, 0, 0], [0, side, 0], [0, 0, 1 + side]].map(([a, b, c]) => new THREE.Vector3(run.x[p] + a * R, run.y[p] + b * R, c * R))));
  });
  const camera = new THREE.PerspectiveCamera(30, 1, reach / 100, 100 * reach);
  camera.up.set(0, 0, 1);
  const orbit = new THREE.OrbitControls(camera, renderer.domElement);
  orbit.maxPolarAngle = Math.PI / 2 - 0.02;

  // ---- panels side by side or, on a tall stage, one above the other: [left, top, width, height] in pixels
  function panel(j) {
    const width = stage.clientWidth, height = stage.clientHeight, tall = height > width, count = runs.length;
    return tall ? [0, j * height / count, width, height / count] : [j * width / count, 0, width / count, height];
  }
  function toward(a, e) { return new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)); }
  // the distance from which all the motion is seen along a direction, the point looked at, and the share of the height it fills
  function fitted(a, e) {
    const [, , width, height] = panel(0), back = toward(a, e), right = new THREE.Vector3(-Math.sin(a), Math.cos(a), 0);
    const up = back.clone().cross(right), v = 0.85 * Math.tan(Math.PI / 12), h = v * width / height; // a margin, for titles
    const target = new THREE.Vector3(middle[0], middle[1], R);
    let far = 0, sizes;
    for (let round = 0; round < 8; round++) {
      const seen = places.map((c) => c.clone().sub(target)).map((c) => [c.dot(right), c.dot(up), c.dot(back)]);
      far = Math.max(...seen.map(([x, y, z]) => z + Math.max(Math.abs(x) / h, Math.abs(y) / v)));
      sizes = [0, 1].map((k) => seen.map((c) => c[k] / (far - c[2])));
      [right, up].forEach((axis, k) => target.addScaledVector(axis, 0.5 * far * (Math.max(...sizes[k]) + Math.min(...sizes[k]))));
    }
    target.addScaledVector(up, 0.1 * far * v); // room for titles
    const [x, y] = sizes.map((of) => Math.max(...of) - Math.min(...of));
    return { far, target, back, filled: x * y };
  }
  let moved = false; // by the reader: then a new size of the window leaves the direction
  function home() {
    const tall = panel(0)[3] > panel(0)[2];
    const best = (tall ? [[-1.05, 0.5], [-0.5, 0.7], [-0.2, 0.8], [-1.4, 0.9]] : [[-1.05, 0.5]]).map(([a, e]) => fitted(a, e))
      .reduce((one, other) => (other.filled > one.filled ? other : one));
    orbit.target.copy(best.target);
    camera.position.copy(best.target).addScaledVector(best.back, best.far);
    orbit.update();
    moved = false;
  }
  function turn(a, e, near) { // by keys
    const from = camera.position.clone().sub(orbit.target), far = from.length();
    const now = [Math.atan2(from.y, from.x) + a, Math.min(Math.max(Math.asin(from.z / far) + e, 0.02), 1.55)];
    camera.position.copy(orbit.target).addScaledVector(toward(...now), far * near);
    orbit.update();
    moved = stale = true;
  }

  function bar(length, width, thick, angle) { // from the hub, lying in the disc's plane; the disc's axle is the x axis, z is up
    return new THREE.BoxGeometry(thick, width, length).translate(0, 0, length / 2).rotateX(-angle);
  }
  const thick = 0.05 * R;
  const rim = new THREE.TorusGeometry(R, 0.022 * R, 6, 48).rotateY(Math.PI / 2);
  const shapes = {
    disc: new THREE.CylinderGeometry(R, R, thick, 48).rotateZ(Math.PI / 2),
    cross: THREE.mergeGeometries([rim, ...[1, 2, 3].map((j) => bar(0.97 * R, 0.05 * R, 1.5 * thick, j * Math.PI / 2))]),
    mark: THREE.mergeGeometries([bar(0.97 * R, 0.15 * R, 1.9 * thick, 0), new THREE.CylinderGeometry(0.12 * R, 0.12 * R, 2.2 * thick, 20).rotateZ(Math.PI / 2)]),
    rod: new THREE.CylinderGeometry(0.07 * R, 0.07 * R, 1, 12).rotateZ(Math.PI / 2),
  };

  function many(scene, shape, material, count) {
    const mesh = new THREE.InstancedMesh(shape, material, count);
    mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
    mesh.frustumCulled = false;
    scene.add(mesh);
    return mesh;
  }

  function build(run) {
    const scene = new THREE.Scene();
    scene.add(new THREE.AmbientLight("#ffffff", 2.2));
    const sun = new THREE.DirectionalLight("#ffffff", 1.4);
    sun.position.set(1, -2, 3);
    scene.add(sun);
    const round = 10 ** Math.floor(Math.log10(reach / 3)), step = [1, 2, 5, 10].map((m) => m * round).find((s) => s >= reach / 6);
    const cells = 2 * Math.ceil(1.5 * reach / step);
    const grid = new THREE.GridHelper(cells * step, cells).rotateX(Math.PI / 2);
    grid.position.set(Math.round(middle[0] / step) * step, Math.round(middle[1] / step) * step, -0.002 * R);
    scene.add(grid);
    grid.material.vertexColors = false;
    const dark = new THREE.MeshLambertMaterial({ color: data.style.ink });
    const parts = {
      disc: many(scene, shapes.disc, new THREE.MeshLambertMaterial(), run.n),
      cross: many(scene, shapes.cross, dark, run.n),
      mark: many(scene, shapes.mark, dark, run.n),
      rod: many(scene, shapes.rod, new THREE.MeshLambertMaterial(), run.n - 1 + run.ring),
    };
    // tracks: for each step of time one short line a disc, so that the first so many are those up to now
    const F = run.t.length, n = run.n, lines = new Float32Array(6 * n * Math.max(F - 1, 0));
    for (let f = 0, p = 0; f < F - 1; f++)
      for (let i = 0; i < n; i++)
        for (const g of [f, f + 1]) { lines[p++] = run.x[g * n + i]; lines[p++] = run.y[g * n + i]; lines[p++] = 0.004 * R; }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(lines, 3));
    const tracks = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    tracks.frustumCulled = false;
    scene.add(tracks);
    return { run, scene, parts, tracks, grid };
  }
  const panels = runs.map(build);
  function paint() { // in the colours of the light or the dark page
    renderer.setClearColor(tone("back"));
    for (const { grid, tracks, parts } of panels) {
      grid.material.color.set(tone("grid"));
      tracks.material.color.set(tone("track"));
      parts.rod.material.color.set(tone("rod"));
    }
    stale = true;
  }

  // ---- a frame: linear between the two recorded ones, or the one before where they are too far apart for that
  function place({ t, held }, time) {
    let low = 0, high = t.length - 1;
    while (high - low > 1) { const m = (low + high) >> 1; if (t[m] <= time) low = m; else high = m; }
    const share = high > low ? (time - t[low]) / (t[high] - t[low]) : 0;
    return [low, high, held ? Number(share >= 1) : Math.min(Math.max(share, 0), 1)];
  }
  const matrix = new THREE.Matrix4(), e1 = new THREE.Vector3(), e2 = new THREE.Vector3(), e3 = new THREE.Vector3();
  function pose({ run, parts, tracks, when }, time) {
    const n = run.n, [f, g, share] = place(run, time), scale = scales[at("colour").value];
    const shown = (1 - share) * run.t[f] + share * run.t[g];
    when.textContent = Math.abs(shown - time) > 1e-9 * (end - start) ? `shown at t = ${shown.toFixed(2)}` : "";
    const now = (values, i) => (1 - share) * values[f * n + i] + share * values[g * n + i];
    for (let i = 0; i < n; i++) {
      const x = now(run.x, i), y = now(run.y, i), axle = now(run.axle, i), theta = now(run.theta, i);
      e1.set(Math.cos(axle), Math.sin(axle), 0);
      e3.set(-Math.sin(axle) * Math.sin(theta), Math.cos(axle) * Math.sin(theta), Math.cos(theta));
      e2.crossVectors(e3, e1);
      matrix.makeBasis(e1, e2, e3).setPosition(x, y, R);
      for (const name of ["disc", "cross", "mark"]) parts[name].setMatrixAt(i, matrix);
      parts.disc.setColorAt(i, colour(scale, now(run[at("colour").value], i)));
    }
    for (let i = 0; i < parts.rod.count; i++) {
      const j = (i + 1) % n, x = now(run.x, i), y = now(run.y, i), dx = now(run.x, j) - x, dy = now(run.y, j) - y;
      const length = Math.hypot(dx, dy) || 1e-9;
      e1.set(dx, dy, 0);
      e2.set(-dy / length, dx / length, 0);
      e3.set(0, 0, 1);
      parts.rod.setMatrixAt(i, matrix.makeBasis(e1, e2, e3).setPosition(x + dx / 2, y + dy / 2, R));
    }
    for (const part of Object.values(parts)) part.instanceMatrix.needsUpdate = true;
    parts.disc.instanceColor.needsUpdate = true;
    tracks.geometry.setDrawRange(0, run.held ? 0 : 2 * n * (time >= run.t.at(-1) ? run.t.length - 1 : f));
  }

  // ---- energy below: from zero, so that what is conserved looks so
  const strip = at("energy");
  const short = (text) => { const signs = Array.from(text); return signs.length > 40 ? `${signs.slice(0, 39).join("")}\u2026` : text; };
  const top = 1.15 * (Math.max(...runs.map((run) => largest(run.energy, 0))) || 1);
  const edge = 16;
  const across = (time) => edge + (strip.clientWidth - 2 * edge) * (time - start) / (end - start || 1);
  function drawEnergy() {
    const ratio = window.devicePixelRatio, width = strip.clientWidth, height = strip.clientHeight;
    strip.width = width * ratio; strip.height = height * ratio;
    const pen = strip.getContext("2d");
    pen.scale(ratio, ratio);
    const up = (value) => height - 8 - (height - 16) * value / top;
    pen.strokeStyle = tone("rule"); pen.beginPath(); pen.moveTo(edge, up(0)); pen.lineTo(width - edge, up(0)); pen.stroke();
    runs.forEach((run, j) => {
      pen.strokeStyle = tone(kinds[j]);
      pen.lineWidth = 2; pen.setLineDash(j ? [6, 4] : []);
      pen.beginPath();
      run.t.forEach((time, f) => pen.lineTo(across(time), up(run.energy[f])));
      pen.stroke();
    });
    pen.setLineDash([]); pen.lineWidth = 1; pen.strokeStyle = tone("ink");
    pen.beginPath(); pen.moveTo(across(now), 2); pen.lineTo(across(now), height - 2); pen.stroke();
  }

  // ---- time
  let now = start, playing = false, last = 0, stale = true;
  scrub.min = start; scrub.max = end;
  function go(time) { now = Math.min(Math.max(time, start), end); stale = true; }
  function play(on) {
    playing = on;
    if (on && now >= end) go(start);
    at("play").textContent = on ? "Pause" : "Play";
    last = performance.now();
  }
  function step(by) { // to the next recorded frame of the first run
    play(false);
    const t = runs[0].t, tiny = 1e-9 * (end - start);
    const next = by > 0 ? t.find((u) => u > now + tiny) : t.findLast((u) => u < now - tiny);
    if (next !== undefined) go(next);
  }

  function resize() {
    renderer.setSize(stage.clientWidth, stage.clientHeight, false);
    const [, , width, height] = panel(0);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    panels.forEach(({ title }, j) => {
      const [left, top, width] = panel(j);
      Object.assign(title.style, { left: `${left}px`, top: `${top}px`, width: `${width}px` });
      if (j) Object.assign(title.style, { borderLeftWidth: left ? "1px" : 0, borderTopWidth: top ? "1px" : 0 });
    });
    if (!moved) home();
    stale = true;
  }

  function legend() {
    const name = at("colour").value, scale = scales[name], pen = at("scale").getContext("2d");
    for (let i = 0; i < 220; i++) {
      pen.fillStyle = `#${colour(scale, scale.low + (scale.high - scale.low) * i / 219).getHexString()}`;
      pen.fillRect(i, 0, 1, 12);
    }
    at("what").textContent = data.label[name];
    at("ends").replaceChildren(...[scale.low, (scale.low + scale.high) / 2, scale.high].map((v) => {
      const text = document.createElement("span");
      text.textContent = v.toPrecision(3);
      return text;
    }));
    stale = true;
  }

  function draw(clock) {
    requestAnimationFrame(draw);
    if (playing) {
      go(now + (clock - last) / 1000 * Number(at("speed").value));
      last = clock;
      if (now >= end) play(false);
    }
    if (!stale) return;
    stale = false;
    scrub.value = now;
    at("time").value = `t = ${now.toFixed(2)}`;
    scrub.setAttribute("aria-valuetext", at("time").value);
    panels.forEach((each, j) => {
      pose(each, now);
      const [left, top, width, height] = panel(j), place = [left, stage.clientHeight - top - height, width, height];
      renderer.setViewport(...place);
      renderer.setScissor(...place);
      renderer.render(each.scene, camera);
    });
    drawEnergy();
  }

  runs.forEach((run, j) => {
    const title = document.createElement("div");
    panels[j].title = title;
    title.className = runs.length > 1 ? `title ${kinds[j]}` : "title";
    const name = document.createElement("div"), when = panels[j].when = document.createElement("div");
    name.className = "name";
    name.textContent = run.title;
    when.className = "when";
    title.append(name, when);
    stage.append(title);
    const energy = document.createElement("div"), swatch = document.createElement("span");
    swatch.className = `swatch ${kinds[j]}`;
    energy.append(swatch, `energy ${run.energy[0].toPrecision(5)}, varies by ${run.drift.toExponential(0)}${runs.length > 1 ? ` (${short(run.title)})` : ""}`);
    at("energies").append(energy);
  });
  at("energy").setAttribute("aria-label", `energy against time: ${at("energies").textContent}`);
  const thinned = runs.filter((run) => run.frames > run.t.length).map((run) => `${short(run.title)}: ${run.t.length} of its ${run.frames} frames are shown, to keep the page small`);
  const held = runs.filter((run) => run.held).map((run) => `${short(run.title)}: its ${run.t.length} frames are too far apart to draw the motion between them, and are shown one by one; take more frames`);
  at("note").replaceChildren(...[...thinned, ...held, `radius drawn ${R.toPrecision(3)}`].map((text) => {
    const line = document.createElement("div");
    line.textContent = text;
    return line;
  }));
  at("play").onclick = () => play(!playing);
  at("home").onclick = home;
  at("colour").onchange = legend;
  scrub.oninput = () => { play(false); go(Number(scrub.value)); };
  const seek = (event) => go(start + (end - start) * (event.offsetX - edge) / (strip.clientWidth - 2 * edge));
  strip.onpointerdown = (event) => { play(false); strip.setPointerCapture(event.pointerId); seek(event); };
  strip.onpointermove = (event) => { if (event.buttons) seek(event); };
  orbit.addEventListener("change", () => { stale = true; });
  orbit.addEventListener("start", () => { moved = true; });
  new ResizeObserver(resize).observe(stage);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
  document.addEventListener("keydown", (event) => {
    const turns = { ArrowRight: () => turn(0.1, 0, 1), ArrowLeft: () => turn(-0.1, 0, 1), ArrowUp: () => turn(0, 0.1, 1), ArrowDown: () => turn(0, -0.1, 1) };
    const zooms = { "+": () => turn(0, 0, 0.9), "-": () => turn(0, 0, 1 / 0.9) };
    const times = { " ": () => play(!playing), ArrowRight: () => step(1), ArrowLeft: () => step(-1), Home: () => go(start), End: () => go(end) };
    const keys = { ...times, ...zooms, ...(event.shiftKey || stage.matches(":focus-visible") ? turns : {}) };
    const takesKeys = ["SELECT", "SUMMARY"].includes(event.target.tagName) || (event.key === " " && event.target.tagName === "BUTTON");
    if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey || takesKeys) return;
    event.preventDefault();
    keys[event.key]();
  }, true);
  // one unit of time a second, unless that is a flash or without end: then the motion takes four to ten seconds
  const size = 10 ** Math.floor(Math.log10((end - start) / 4)), usual = end - start >= 0.9 && end - start <= 40 || end === start;
  const rate = usual ? 1 : [5, 2, 1].map((m) => m * size).find((m) => (end - start) / m >= 4);
  for (const m of [0.25, 0.5, 1, 2, 4]) at("speed").add(new Option(Number((m * rate).toPrecision(3)), m * rate, m === 1, m === 1));
  globalThis.discs = { panels, camera, go, play }; // for the console
  resize();
  legend();
  paint();
  play(end > start && !matchMedia("(prefers-reduced-motion: reduce)").matches);
  requestAnimationFrame(draw);
})();
