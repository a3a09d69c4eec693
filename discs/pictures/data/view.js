"use strict";
// The page of a run; stage.js before it draws the discs.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const at = (id) => document.getElementById(id);
  const element = at("stage"), scrub = at("scrub");
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

  // ---- the stage, with a view of all the motion: some of its places
  let stage;
  try {
    stage = makeStage({ element, count: runs.length, radius: data.radius, style: data.style, tone });
  } catch (error) {
    at("note").textContent = "This browser shows no WebGL, which the discs are drawn with.";
    return;
  }
  stage.show(runs.flatMap((run) => {
    const every = Math.ceil(run.x.length / 300), picked = Array.from(run.x.keys()).filter((p) => p % every === 0);
    const ends = [run.x, run.y].flatMap((values) => [smallest, largest].map((of) => values.indexOf(of(values, values[0]))));
    return [...picked, ...ends].map((p) => [run.x[p], run.y[p]]);
  }));
  const panels = runs.map((run) => ({ run, ...stage.build(run.n, run.ring, tracks(run)) }));
  function tracks(run) { // for each step of time one short line a disc, so that the first so many are those up to now
    const F = run.t.length, n = run.n, lines = new Float32Array(6 * n * Math.max(F - 1, 0));
    for (let f = 0, p = 0; f < F - 1; f++)
      for (let i = 0; i < n; i++)
        for (const g of [f, f + 1]) { lines[p++] = run.x[g * n + i]; lines[p++] = run.y[g * n + i]; lines[p++] = 0.004 * data.radius; }
    return lines;
  }

  // ---- colour: the same scale for both runs
  const scales = {};
  for (const name of ["theta", "omega", "stretch", "force"]) {
    if (!runs.every((run) => run[name])) continue;
    const high = Math.max(...runs.map((run) => largest(run[name], -Infinity)));
    const low = Math.min(...runs.map((run) => smallest(run[name], Infinity)));
    scales[name] = stage.scale(name, low, high);
    at("colour").add(new Option(data.label[name], name));
  }
  // at first by the rates, unless all discs are at rest then
  at("colour").value = runs.some((run) => run.omega.subarray(0, run.n).some((value) => value)) ? "omega" : "theta";

  // ---- a frame: linear between the two recorded ones, or the one before where they are too far apart for that
  function place({ t, held }, time) {
    let low = 0, high = t.length - 1;
    while (high - low > 1) { const m = (low + high) >> 1; if (t[m] <= time) low = m; else high = m; }
    const share = high > low ? (time - t[low]) / (t[high] - t[low]) : 0;
    return [low, high, held ? Number(share >= 1) : Math.min(Math.max(share, 0), 1)];
  }
  function pose(each, time) {
    const { run, tracks, when } = each, n = run.n, [f, g, share] = place(run, time), tinted = at("colour").value;
    const shown = (1 - share) * run.t[f] + share * run.t[g];
    when.textContent = Math.abs(shown - time) > 1e-9 * (end - start) ? `shown at t = ${shown.toFixed(2)}` : "";
    const now = (name) => (i) => (1 - share) * run[name][f * n + i] + share * run[name][g * n + i];
    const value = now(tinted);
    stage.pose(each, { x: now("x"), y: now("y"), axle: now("axle"), theta: now("theta"), tint: (i) => stage.colour(scales[tinted], value(i)) });
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
  let now = start, playing = false, last = 0;
  scrub.min = start; scrub.max = end;
  function go(time) { now = Math.min(Math.max(time, start), end); stage.stale = true; }
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
    panels.forEach(({ title }, j) => {
      const [left, top, width] = stage.panel(j);
      Object.assign(title.style, { left: `${left}px`, top: `${top}px`, width: `${width}px` });
      if (j) Object.assign(title.style, { borderLeftWidth: left ? "1px" : 0, borderTopWidth: top ? "1px" : 0 });
    });
    stage.resize();
  }

  function legend() {
    const name = at("colour").value, scale = scales[name];
    stage.legend(at("scale"), scale);
    at("what").textContent = data.label[name];
    at("ends").replaceChildren(...[scale.low, (scale.low + scale.high) / 2, scale.high].map((v) => {
      const text = document.createElement("span");
      text.textContent = v.toPrecision(3);
      return text;
    }));
    stage.stale = true;
  }

  function draw(clock) {
    requestAnimationFrame(draw);
    if (playing) {
      go(now + (clock - last) / 1000 * Number(at("speed").value));
      last = clock;
      if (now >= end) play(false);
    }
    if (!stage.stale) return;
    stage.stale = false;
    scrub.value = now;
    at("time").value = `t = ${now.toFixed(2)}`;
    scrub.setAttribute("aria-valuetext", at("time").value);
    panels.forEach((each) => pose(each, now));
    stage.render(panels);
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
    element.append(title);
    const energy = document.createElement("div"), swatch = document.createElement("span");
    swatch.className = `swatch ${kinds[j]}`;
    energy.append(swatch, `energy ${run.energy[0].toPrecision(5)}, varies by ${run.drift.toExponential(0)}${runs.length > 1 ? ` (${short(run.title)})` : ""}`);
    at("energies").append(energy);
  });
  at("energy").setAttribute("aria-label", `energy against time: ${at("energies").textContent}`);
  const thinned = runs.filter((run) => run.frames > run.t.length).map((run) => `${short(run.title)}: ${run.t.length} of its ${run.frames} frames are shown, to keep the page small`);
  const held = runs.filter((run) => run.held).map((run) => `${short(run.title)}: its ${run.t.length} frames are too far apart to draw the motion between them, and are shown one by one; take more frames`);
  at("note").replaceChildren(...[...thinned, ...held, `radius drawn ${data.radius.toPrecision(3)}`].map((text) => {
    const line = document.createElement("div");
    line.textContent = text;
    return line;
  }));
  at("play").onclick = () => play(!playing);
  at("home").onclick = stage.home;
  at("colour").onchange = legend;
  scrub.oninput = () => { play(false); go(Number(scrub.value)); };
  const seek = (event) => go(start + (end - start) * (event.offsetX - edge) / (strip.clientWidth - 2 * edge));
  strip.onpointerdown = (event) => { play(false); strip.setPointerCapture(event.pointerId); seek(event); };
  strip.onpointermove = (event) => { if (event.buttons) seek(event); };
  new ResizeObserver(resize).observe(element);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => stage.paint(panels));
  document.addEventListener("keydown", (event) => {
    const turns = { ArrowRight: () => stage.turn(0.1, 0, 1), ArrowLeft: () => stage.turn(-0.1, 0, 1), ArrowUp: () => stage.turn(0, 0.1, 1), ArrowDown: () => stage.turn(0, -0.1, 1) };
    const zooms = { "+": () => stage.turn(0, 0, 0.9), "-": () => stage.turn(0, 0, 1 / 0.9) };
    const times = { " ": () => play(!playing), ArrowRight: () => step(1), ArrowLeft: () => step(-1), Home: () => go(start), End: () => go(end) };
    const keys = { ...times, ...zooms, ...(event.shiftKey || element.matches(":focus-visible") ? turns : {}) };
    const takesKeys = ["SELECT", "SUMMARY"].includes(event.target.tagName) || (event.key === " " && event.target.tagName === "BUTTON");
    if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey || takesKeys) return;
    event.preventDefault();
    keys[event.key]();
  }, true);
  // one unit of time a second, unless that is a flash or without end: then the motion takes four to ten seconds
  const size = 10 ** Math.floor(Math.log10((end - start) / 4)), usual = end - start >= 0.9 && end - start <= 40 || end === start;
  const rate = usual ? 1 : [5, 2, 1].map((m) => m * size).find((m) => (end - start) / m >= 4);
  for (const m of [0.25, 0.5, 1, 2, 4]) at("speed").add(new Option(Number((m * rate).toPrecision(3)), m * rate, m === 1, m === 1));
  globalThis.discs = { panels, camera: stage.camera, orbit: stage.orbit, go, play }; // for the console
  resize();
  legend();
  stage.paint(panels);
  play(end > start && !matchMedia("(prefers-reduced-motion: reduce)").matches);
  requestAnimationFrame(draw);
})();
