"use strict";
// Discs in three dimensions: z is up, the plane is z = 0; d_1 along the axle, the spoke d_3 = cos(theta) e_z + sin(theta) J d_1.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const at = (id) => document.getElementById(id);
  const stage = at("stage"), scrub = at("scrub");
  const R = data.radius;
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
    at("colour").add(new Option(data.label[name], name, name === "omega", name === "omega"));
  }
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
  renderer.setClearColor("#fcfcfa");
  renderer.setScissorTest(true);
  stage.prepend(renderer.domElement);
  const low = [0, 1].map((j) => Math.min(...runs.map((run) => smallest(j ? run.y : run.x, Infinity))) - 2 * R);
  const high = [0, 1].map((j) => Math.max(...runs.map((run) => largest(j ? run.y : run.x, -Infinity))) + 2 * R);
  const middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
  const reach = Math.hypot(high[0] - low[0], high[1] - low[1]) / 2;
  const camera = new THREE.PerspectiveCamera(30, 1, reach / 100, 40 * reach);
  camera.up.set(0, 0, 1);
  const orbit = new THREE.OrbitControls(camera, renderer.domElement);
  orbit.maxPolarAngle = Math.PI / 2 - 0.02;
  function home() {
    const width = stage.clientWidth / runs.length, height = stage.clientHeight;
    const far = reach / Math.tan(Math.PI / 12) * Math.max(0.52, 0.8 * height / width), a = -1.05, e = 0.5;
    orbit.target.set(middle[0], middle[1], R);
    camera.position.set(middle[0] + far * Math.cos(e) * Math.cos(a), middle[1] + far * Math.cos(e) * Math.sin(a), R + far * Math.sin(e));
    orbit.update();
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
    const grid = new THREE.GridHelper(cells * step, cells, data.style.ground, data.style.ground).rotateX(Math.PI / 2);
    grid.position.set(Math.round(middle[0] / step) * step, Math.round(middle[1] / step) * step, -0.002 * R);
    scene.add(grid);
    const dark = new THREE.MeshLambertMaterial({ color: data.style.ink });
    const parts = {
      disc: many(scene, shapes.disc, new THREE.MeshLambertMaterial(), run.n),
      cross: many(scene, shapes.cross, dark, run.n),
      mark: many(scene, shapes.mark, dark, run.n),
      rod: many(scene, shapes.rod, dark, run.n - 1 + run.ring),
    };
    // tracks: for each step of time one short line a disc, so that the first so many are those up to now
    const F = run.t.length, n = run.n, lines = new Float32Array(6 * n * Math.max(F - 1, 0));
    for (let f = 0, p = 0; f < F - 1; f++)
      for (let i = 0; i < n; i++)
        for (const g of [f, f + 1]) { lines[p++] = run.x[g * n + i]; lines[p++] = run.y[g * n + i]; lines[p++] = 0.004 * R; }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(lines, 3));
    const tracks = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: data.style.grey, transparent: true, opacity: 0.55 }));
    tracks.frustumCulled = false;
    scene.add(tracks);
    return { run, scene, parts, tracks };
  }
  const panels = runs.map(build);

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
    const up = (value) => height - 8 - (height - 30) * value / top;
    pen.strokeStyle = "#ccc"; pen.beginPath(); pen.moveTo(edge, up(0)); pen.lineTo(width - edge, up(0)); pen.stroke();
    pen.font = "13px system-ui, 'DejaVu Sans', sans-serif";
    let left = edge;
    runs.forEach((run, j) => {
      pen.strokeStyle = pen.fillStyle = data.style.runs[j];
      pen.lineWidth = 2; pen.setLineDash(j ? [6, 4] : []);
      pen.beginPath();
      run.t.forEach((time, f) => pen.lineTo(across(time), up(run.energy[f])));
      pen.stroke();
      const text = `${j ? "- -" : "\u2014"} energy ${run.energy[0].toPrecision(5)}, varies by ${run.drift.toExponential(0)}${runs.length > 1 ? ` (${short(run.title)})` : ""}`;
      pen.fillText(text, left, 14);
      left += pen.measureText(text).width + 28;
    });
    pen.setLineDash([]); pen.lineWidth = 1; pen.strokeStyle = data.style.ink;
    pen.beginPath(); pen.moveTo(across(now), 20); pen.lineTo(across(now), height - 4); pen.stroke();
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
    const width = stage.clientWidth, height = stage.clientHeight;
    renderer.setSize(width, height, false);
    camera.aspect = width / runs.length / height;
    camera.updateProjectionMatrix();
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
    const width = stage.clientWidth / panels.length, height = stage.clientHeight;
    panels.forEach((panel, j) => {
      pose(panel, now);
      renderer.setViewport(j * width, 0, width, height);
      renderer.setScissor(j * width, 0, width, height);
      renderer.render(panel.scene, camera);
    });
    drawEnergy();
  }

  runs.forEach((run, j) => {
    const title = document.createElement("div");
    title.className = "title";
    const name = document.createElement("div"), when = panels[j].when = document.createElement("div");
    name.className = "name";
    name.textContent = run.title;
    when.className = "when";
    title.append(name, when);
    title.style.left = `${100 * j / runs.length}%`;
    title.style.width = `${100 / runs.length}%`;
    if (runs.length > 1) title.style.color = data.style.runs[j];
    if (j) title.style.borderLeft = "1px solid #ddd";
    stage.append(title);
  });
  const held = runs.filter((run) => run.held).map((run) => `${short(run.title)}: its ${run.t.length} frames are too far apart to draw the motion between them, and are shown one by one; take more frames`);
  at("note").replaceChildren(...[...held, `radius drawn ${R.toPrecision(3)}`].map((text) => {
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
  window.addEventListener("resize", resize);
  document.addEventListener("keydown", (event) => {
    const keys = { " ": () => play(!playing), ArrowRight: () => step(1), ArrowLeft: () => step(-1), Home: () => go(start), End: () => go(end) };
    if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey || event.target.tagName === "SELECT") return;
    event.preventDefault();
    keys[event.key]();
  }, true);
  globalThis.discs = { panels, camera, go, play }; // for the console
  resize();
  home();
  legend();
  requestAnimationFrame(draw);
})();
