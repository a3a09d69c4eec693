// The page of the lab; three.js and stage.js stand before it. It asks for frames and draws them: `render({ model, el, whole })`, where
// model.send(message) and model.on("msg:custom", (content, buffers) => ...) are those of anywidget, or a WebSocket's (socket.js).
const TRAIL = 300; // frames whose paths are drawn
const DRAWN = 400; // points of a plot, at most twice as many are kept

function make(name, properties = {}, ...children) {
  const { className, ...rest } = properties, element = document.createElement(name);
  if (className) element.className = className;
  for (const [key, value] of Object.entries(rest)) key in element ? element[key] = value : element.setAttribute(key, value);
  element.dataset.lmSuppressShortcuts = "true"; // JupyterLab takes no keys that are pressed here
  element.append(...children);
  return element;
}

function render({ model, el, whole = false }) {
  const root = make("div", { className: "discs-lab", tabIndex: -1 });
  const tone = (name) => getComputedStyle(root).getPropertyValue(`--${name}`).trim();
  const option = (value, text = value) => make("option", { value }, text);
  const group = (title, ...children) => make("fieldset", {}, make("legend", {}, title), ...children);
  const named = (text, control) => make("label", {}, text, control);
  const check = (text, input) => make("label", { className: "check" }, input, text);

  // ---- the controls
  const play = make("button", { className: "play" }, "Pause"), back = make("button", { title: "one frame back (left arrow)" }, "Back");
  const step = make("button", { title: "one step (right arrow)" }, "Step"), reset = make("button", { title: "start again (r)" }, "Reset");
  const rewind = make("input", { type: "range", min: 0, max: 0, step: "any", value: 0, "aria-label": "time; go back to an earlier one" });
  const time = make("output", { className: "time" }, "t = 0.00");
  const speed = make("select", {}, ...[0.1, 0.25, 0.5, 1, 2, 4].map((value) => make("option", { value, selected: value === 1 }, String(value))));
  const view = make("button", { className: "view" }, "Reset view");
  const chosen = {
    scene: make("select"), n: make("input", { type: "number", min: 2, step: 1, inputMode: "numeric" }), rolling: make("select"), ends: make("select"),
    method: make("select"), dt: make("select"),
  };
  const names = { scene: "scene", n: "discs N", rolling: "rolling law", ends: "ends", method: "method", dt: "time step" };
  const sliders = make("div");
  const tools = Object.fromEntries(["pull", "kick", "hold"].map((name) => [name, make("button", { "aria-pressed": String(name === "pull") },
    { pull: "Pull", kick: "Kick", hold: "Hold" }[name])]));
  const disc = make("input", { type: "number", min: 0, step: 1, value: 0, inputMode: "numeric" });
  const kick = make("input", { type: "number", min: -100, max: 100, step: "any", value: 2 });
  const doKick = make("button", { title: "k" }, "Kick it"), doHold = make("button", { title: "h" }, "Hold it");
  const colour = make("select"), forces = make("input", { type: "checkbox" }), compare = make("input", { type: "checkbox", checked: true });
  const copies = ["python", "toml"].map((language) => make("button", {}, language === "toml" ? "Copy as TOML" : "Copy as Python"));
  const saves = [".nc", ".csv"].map((ending) => make("button", {}, `Save ${ending}`));
  const text = make("pre", { hidden: true, tabIndex: 0, "aria-label": "the scene as text" }), copied = make("p", { className: "soft", role: "status" });
  const element = make("div", { className: "stage", tabIndex: 0, role: "application", "aria-label":
    "The discs in three dimensions. Shift and arrow keys turn, plus and minus zoom. Drag a disc to pull it, drag elsewhere to turn." });
  const titles = ["first", "second"].map((name) => make("div", { className: `title ${name}` }, make("div"), make("div", { className: "more" })));
  const scaleStrip = make("canvas", { width: 180, height: 12, "aria-hidden": "true" }), ends = make("div", { className: "ends" }), what = make("span");
  const legend = make("div", { className: "legend" }, what, scaleStrip, ends);
  const said = make("span"), dismiss = make("button", { "aria-label": "close this message" }, "✕");
  const message = make("div", { className: "message", role: "alert", hidden: true }, said, dismiss);
  const plots = ["energy", "error"].map((name) => ({ canvas: make("canvas", { role: "img", "aria-label": `${name} against time` }), numbers: make("div", { className: "numbers" }) }));
  const about = make("p", { className: "soft" });
  element.append(...titles, legend, view, message);
  root.append(make("div", { className: "all" },
    make("div", { className: "top" }, element,
      make("div", { className: "bar" }, play, back, step, reset, rewind, time, named("speed ", speed))),
    make("div", { className: "plots" }, ...plots.map(({ canvas, numbers }) => make("div", { className: "plot" }, numbers, canvas))),
    make("div", { className: "side" },
      group("Scene", make("div", { className: "pairs" }, ...Object.entries(chosen).map(([name, control]) => named(names[name], control)))),
      group("Sliders", sliders),
      group("Hand", make("p", { className: "soft" }, "With the mouse or a finger on a disc:"), make("div", { className: "row" }, ...Object.values(tools)),
        make("div", { className: "pairs" }, named("disc", disc), named("kick, change of ω", kick)), make("div", { className: "row" }, doKick, doHold)),
      group("Show", named("colour ", colour), make("div", { className: "row" }, check("forces of the ground", forces), check("the field beside", compare))),
      group("Keep", make("div", { className: "row" }, ...copies, ...saves), copied, text),
      group("Keys", make("p", { className: "soft" }, "space: play or pause. Right and left arrow: one step, one frame back. r: reset. k, h: kick or hold the disc. Shift and arrows: turn. + and −: zoom."), about))));
  el.append(root);

  let stage;
  function tell(what) { said.textContent = what; message.hidden = !what; }
  dismiss.onclick = () => tell("");

  // ---- messages: one at a time; of a slider or a pull only the last value is sent
  let waiting = false, over = false, last = performance.now(), playing = true;
  const queue = [], latest = new Map();
  const stats = { frames: 0, slider: [] }; // for tests: frames drawn, milliseconds from a slider's event to its frame
  let moved = 0;
  function ask(content) { queue.push(content); }
  function send(content) { waiting = true; model.send(content); }
  function pump(now) {
    if (waiting || over) return;
    if (queue.length) return send(queue.shift());
    for (const [key, content] of latest) { latest.delete(key); return send(content); }
    const passed = Math.min((now - last) / 1000, 0.1);
    last = now;
    if (playing && passed > 0) send({ kind: "advance", time: passed * Number(speed.value) });
  }

  // ---- what the session is
  let scene = null, frame = null, panels = [], trail = { head: 0, filled: 0, before: null }, arrows = null;
  const history = { t: [], energy: [], work: [], dissipated: [], place: [], angle: [] };
  const scales = {};
  const row = (name) => (i) => frame.rows[name][i];

  function described(content) {
    const fresh = !scene || ["discs", "ring", "radius"].some((key) => JSON.stringify(scene[key]) !== JSON.stringify(content[key]));
    scene = content;
    for (const [name, control] of Object.entries(chosen)) {
      if (name === "n") { control.max = content.most; control.value = content.chosen.n; continue; }
      const shown = { steered_rod: "own headings", untwisting_rod: "untwisting rod", rolling_rod: "rolling rod", breathing_ring: "breathing ring" };
      control.replaceChildren(...content.choices[name].map((value) => option(value, shown[value] ?? String(value))));
      control.value = content.chosen[name];
      control.disabled = content.choices[name].length < 2;
    }
    disc.max = content.chosen.n - 1;
    const kept = new Map(Array.from(sliders.children, (label) => [label.dataset.name, label]));
    sliders.replaceChildren(...content.sliders.map((slider) => {
      const label = kept.get(slider.name) ?? sliderOf(slider), input = label.querySelector("input");
      Object.assign(input, { min: slider.low, max: slider.high, step: (slider.high - slider.low) / 200 });
      if (document.activeElement !== input || !latest.has(slider.name)) input.value = slider.value;
      label.querySelector("output").textContent = Number(slider.value).toPrecision(3);
      return label;
    }));
    if (!colour.options.length) for (const name of ["omega", "theta", "stretch", "force"]) colour.add(option(name, content.labels[name]));
    if (fresh) rebuild();
  }

  function sliderOf({ name, label, again }) {
    const input = make("input", { type: "range", "aria-label": label }), output = make("output");
    input.oninput = () => {
      moved = moved || performance.now();
      output.textContent = Number(input.value).toPrecision(3);
      latest.set(name, { kind: "set", name, value: Number(input.value) });
      if (again) clear();
    };
    const whole = make("label", { className: "slider" }, make("span", {}, label), output, input);
    whole.dataset.name = name;
    return whole;
  }

  function rebuild() { // the stage for so many discs
    stage?.close();
    for (const name of Object.keys(scales)) delete scales[name];
    const style = { ink: "#222222", signed: ["#0072B2", "#e8d59a", "#D55E00"], unsigned: ["#f2f7f5", "#8accb5", "#00704f"] };
    try {
      stage = makeStage({ element, count: 1, radius: scene.radius, style, tone, live: true });
    } catch (error) {
      tell("This browser shows no WebGL, which the discs are drawn with.");
      return;
    }
    panels = [];
  }

  function settle() { // the panels for a first frame: where the discs are and will roll
    const n = frame.n, mid = fit();
    for (const each of panels) stage.drop(each);
    panels = [0, 1].map(() => stage.build(n, Number(scene.ring), new Float32Array(6 * n * TRAIL)));
    arrows = stage.rods(panels[0].scene, 2 * n + 1, 0.5);
    followed = mid;
    clear();
    stage.paint(panels);
    arrows.material.color.set(tone("push"));
    resize();
    stage.home();
  }

  function fit() { // what the view shows when it is reset; the middle of the discs
    const n = frame.n, points = Array.from({ length: n }, (_, i) => [frame.rows.x[i], frame.rows.y[i]]);
    const mid = [0, 1].map((k) => points.reduce((sum, p) => sum + p[k], 0) / n);
    stage.show([...points, [mid[0], mid[1] - 0.2 * scene.length], [mid[0], mid[1] + 0.2 * scene.length]]);
    return mid;
  }

  function clear() { // the plots and the trails
    for (const values of Object.values(history)) values.length = 0;
    trail = { head: 0, filled: 0, before: null };
    for (const { tracks } of panels) tracks.geometry.setDrawRange(0, 0);
  }

  // ---- a frame
  let followed = [0, 0];
  function framed(content, buffer) {
    const size = content.n, rows = {};
    content.rows.forEach((name, j) => {
      rows[name] = Float32Array.from({ length: size }, (_, i) => buffer.getFloat32(4 * (j * size + i), true));
    });
    const first = !frame || !panels.length || frame.n !== size, jumped = frame && content.t < frame.t;
    frame = { ...content, rows };
    if (!stage) return;
    if (first) settle();
    const count = content.error ? 2 : 1;
    if (stage.count !== count && pulling === null) { stage.count = count; fit(); resize(); }
    if (jumped) trail = { head: 0, filled: 0, before: null };
    remember();
    follow();
    stage.stale = true;
  }

  function remember() {
    const { t, energy, work, dissipated, error } = frame;
    while (history.t.length && history.t.at(-1) >= t) for (const values of Object.values(history)) values.pop();
    const values = { t, energy, work, dissipated, place: error?.place ?? NaN, angle: error?.angle ?? NaN };
    for (const [name, value] of Object.entries(values)) history[name].push(value);
    if (history.t.length > 2 * DRAWN) for (const [name, kept] of Object.entries(history)) history[name] = kept.filter((_, i) => i % 2 === 0 || i === kept.length - 1);
    const { x, y } = frame.rows, n = frame.n;
    if (trail.before && trail.t < t) {
      const { tracks } = panels[0], place = tracks.geometry.attributes.position, base = 6 * n * trail.head;
      for (let i = 0, p = base; i < n; i++)
        for (const [xs, ys] of [[trail.before.x, trail.before.y], [x, y]]) { place.array[p++] = xs[i]; place.array[p++] = ys[i]; place.array[p++] = 0.004 * scene.radius; }
      place.addUpdateRange(base, 6 * n);
      place.needsUpdate = true;
      trail.head = (trail.head + 1) % TRAIL;
      trail.filled = Math.min(trail.filled + 1, TRAIL);
    }
    if (!trail.before || trail.t !== t) Object.assign(trail, { before: { x, y }, t });
    panels[0].tracks.geometry.setDrawRange(0, 2 * n * trail.filled);
  }

  function follow() { // the camera goes with the middle of the discs, the grid by whole cells
    const mid = ["x", "y"].map((name) => frame.rows[name].reduce((sum, value) => sum + value, 0) / frame.n);
    const [dx, dy] = mid.map((value, k) => value - followed[k]);
    followed = mid;
    if (!Number.isFinite(dx + dy) || pulling) return;
    for (const point of [stage.camera.position, stage.orbit.target]) { point.x += dx; point.y += dy; }
    for (const { grid, step } of panels) grid.position.set(Math.round(mid[0] / step) * step, Math.round(mid[1] / step) * step, grid.position.z);
  }

  function tinted(prefix) {
    const name = colour.value, value = name === "force" ? (i) => Math.hypot(frame.rows.force_x[i], frame.rows.force_y[i]) : row(name);
    if (prefix) return () => stage.colour({ low: 0, high: 1, stops: [stage.plain, stage.plain] }, 0);
    let low = Infinity, high = -Infinity;
    for (let i = 0; i < frame.n; i++) { const v = value(i); low = Math.min(low, v); high = Math.max(high, v); }
    const old = scales[name], of = stage.scale(name, Math.min(low, old?.from ?? low), Math.max(high, old?.to ?? high));
    scales[name] = { ...of, from: Math.min(low, old?.from ?? low), to: Math.max(high, old?.to ?? high) };
    if (!old || old.low !== of.low || old.high !== of.high || scales.shown !== name) {
      stage.legend(scaleStrip, scales[name]);
      what.textContent = scene.labels[name];
      ends.replaceChildren(...[of.low, (of.low + of.high) / 2, of.high].map((v) => make("span", {}, v.toPrecision(3))));
      scales.shown = name;
    }
    return (i) => stage.colour(scales[name], value(i));
  }

  function draw() {
    const R = scene.radius, n = frame.n;
    stage.pose(panels[0], { x: row("x"), y: row("y"), axle: row("axle"), theta: row("theta"), tint: tinted("") });
    if (frame.error) stage.pose(panels[1], { x: row("field_x"), y: row("field_y"), axle: row("field_axle"), theta: row("field_theta"), tint: tinted("field_") });
    const { x, y, force_x: fx, force_y: fy } = frame.rows;
    let largest = 0;
    for (let i = 0; i < n; i++) largest = Math.max(largest, Math.hypot(fx[i], fy[i]));
    const size = forces.checked && largest ? 0.3 * scene.length / largest : 0;
    for (let i = 0; i < n; i++) stage.lay(arrows, i, [x[i], y[i], 0.03 * R], [x[i] + size * fx[i], y[i] + size * fy[i], 0.03 * R]);
    for (let i = 0; i < n; i++) stage.lay(arrows, n + i, [x[i], y[i], 0], [x[i], y[i], frame.held.includes(scene.discs[i]) ? 2.5 * R : 0]);
    const j = frame.pulled ? scene.discs.indexOf(frame.pulled[0]) : -1;
    stage.lay(arrows, 2 * n, j < 0 ? [0, 0, 0] : [x[j], y[j], R], j < 0 ? [0, 0, 0] : [frame.pulled[1], frame.pulled[2], R]);
    stage.render(panels.slice(0, stage.count));
    if (frame.stopped) { tell(`The motion cannot go on: ${frame.stopped}`); pause(true); }
  }

  function write() { // what is read and not watched: a few times a second
    const R = scene.radius;
    plot();
    time.textContent = `t = ${frame.t.toFixed(2)}`;
    Object.assign(rewind, { min: frame.first, max: Math.max(frame.last, frame.t) });
    rewind.value = frame.t;
    rewind.setAttribute("aria-valuetext", time.textContent);
    titles[0].children[0].textContent = `${scene.chosen.n} discs`;
    titles[0].children[1].textContent = [frame.beside, frame.late ? "slower than real time" : "", frame.held.length ? `held: ${frame.held.join(", ")}` : ""].filter(Boolean).join(" ");
    titles[1].children[0].textContent = stage.count === 2 ? "the field" : "";
    doHold.textContent = frame.held.includes(Number(disc.value)) ? "Let it go" : "Hold it";
    about.textContent = `Radius drawn ${R.toPrecision(3)}. The ${frame.engine === "plain" ? "plain engine: kernels are being read or compiled" : "compiled engine"}.`;
  }

  // ---- plots
  const number = (value) => (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e4) || value === 0 ? value.toPrecision(4) : value.toExponential(1);
  const entry = (kind, label, value) => make("span", {}, make("span", { className: `swatch ${kind}` }), `${label} ${value}`);
  const LINES = [["first", []], ["second", [6, 4]], ["third", [2, 3]]];
  function plot() {
    const off = frame.off, error = frame.error;
    plots[0].numbers.replaceChildren(entry("first", "energy", number(frame.energy)), entry("second", "work", number(frame.work)), entry("third", "dissipated", number(frame.dissipated)),
      make("span", {}, `balance off by ${off === 0 ? 0 : Math.abs(off).toExponential(0)}`));
    plots[1].numbers.replaceChildren(...(error ? [entry("first", "distance from the field: place", number(error.place)), entry("second", "angle", number(error.angle))]
      : [make("span", {}, compare.checked ? frame.beside || "no field" : "the field is off")]));
    curves(plots[0].canvas, [history.energy, history.work, history.dissipated]);
    curves(plots[1].canvas, [history.place, history.angle]);
  }
  function curves(canvas, lines) {
    const ratio = window.devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight, edge = 6;
    const pen = canvas.getContext("2d", { willReadFrequently: true }), t = history.t; // drawn without the graphics card, which is busy
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio))
      Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.setLineDash([]);
    pen.lineWidth = 1;
    let low = 0, high = 1e-300;
    for (const values of lines) for (const v of values) if (Number.isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); }
    const start = t[0] ?? 0, end = Math.max(t.at(-1) ?? 1, start + 1e-9);
    const across = (v) => edge + (width - 2 * edge) * (v - start) / (end - start), up = (v) => height - edge - (height - 2 * edge) * (v - low) / (high - low);
    pen.strokeStyle = tone("rule"); pen.beginPath(); pen.moveTo(edge, up(0)); pen.lineTo(width - edge, up(0)); pen.stroke();
    pen.lineWidth = 2;
    lines.forEach((values, j) => {
      pen.strokeStyle = tone(LINES[j][0]); pen.setLineDash(LINES[j][1]); pen.beginPath();
      let pendown = false;
      values.forEach((v, i) => {
        if (!Number.isFinite(v)) { pendown = false; return; }
        pendown ? pen.lineTo(across(t[i]), up(v)) : pen.moveTo(across(t[i]), up(v));
        pendown = true;
      });
      pen.stroke();
    });
  }

  // ---- replies
  const heard = {
    scene: described,
    frame(content, buffers) {
      framed(content, buffers[0]);
      if (moved && !latest.size) { stats.asked = moved; moved = 0; }
      waiting = false;
    },
    refused({ text: reason }) { tell(reason); latest.clear(); },
    note({ text: reason }) { tell(reason); },
    code({ text: source }) {
      waiting = false;
      text.textContent = source;
      text.hidden = false;
      navigator.clipboard?.writeText(source).then(() => { copied.textContent = "Copied; here it is too:"; }, () => { copied.textContent = "Select and copy:"; });
    },
    file({ name }, buffers) {
      waiting = false;
      const { buffer, byteOffset, byteLength } = buffers[0];
      const address = URL.createObjectURL(new Blob([new Uint8Array(buffer, byteOffset, byteLength)]));
      make("a", { href: address, download: name }).click();
      setTimeout(() => URL.revokeObjectURL(address), 1000);
    },
    ended({ text: reason }) { over = true; tell(reason); },
    closed() { over = true; if (message.hidden) tell("The lab has ended. Start it again: python -m compare lab"); },
  };
  model.on("msg:custom", (content, buffers = []) => heard[content.kind]?.(content, buffers));

  // ---- the controls' work
  function pause(on) {
    playing = !on;
    last = performance.now();
    play.textContent = on ? "Play" : "Pause";
  }
  function pace(by) { pause(true); ask({ kind: "step", by }); }
  const again = () => { tell(""); clear(); ask({ kind: "reset" }); };
  play.onclick = () => pause(playing);
  back.onclick = () => pace("back");
  step.onclick = () => pace("forward");
  reset.onclick = again;
  rewind.oninput = () => { pause(true); latest.set("seek", { kind: "seek", time: Number(rewind.value) }); };
  view.onclick = () => { if (frame && panels.length) { fit(); stage.home(); } };
  colour.onchange = forces.onchange = () => { if (stage) stage.stale = true; };
  compare.onchange = () => ask({ kind: "compare", on: compare.checked });
  for (const [name, control] of Object.entries(chosen)) {
    control.onchange = () => {
      if (control.value === "") return;
      const value = ["n", "dt"].includes(name) ? Number(control.value) : control.value;
      if (!["method", "dt"].includes(name)) { clear(); frame = null; }
      tell("");
      ask({ kind: "choose", [name]: value });
    };
  }
  let tool = "pull";
  for (const [name, button] of Object.entries(tools)) button.onclick = () => {
    tool = name;
    for (const [other, each] of Object.entries(tools)) each.setAttribute("aria-pressed", String(other === name));
  };
  const kicked = (number) => ask({ kind: "kick", disc: number, change: Number(kick.value) });
  const held = (number) => ask({ kind: "hold", disc: number, on: !frame.held.includes(number) });
  doKick.onclick = () => kicked(Number(disc.value));
  doHold.onclick = () => held(Number(disc.value));
  copies.forEach((button, j) => { button.onclick = () => { copied.textContent = ""; ask({ kind: "code", language: ["python", "toml"][j] }); }; });
  saves.forEach((button, j) => { button.onclick = () => ask({ kind: "save", ending: [".nc", ".csv"][j] }); });

  // ---- the hand: a disc near the pointer is pulled, or kicked or held when the pointer is released; elsewhere the pointer turns the view
  let pulling = null, pointer = null, tapped = null; // the disc that is pulled, the last event of the pointer that pulls, where a click began
  function near(event) {
    if (!stage || !frame || !panels.length) return -1;
    const { left, top } = element.getBoundingClientRect(), [, , width, height] = stage.panel(0);
    const px = event.clientX - left, py = event.clientY - top;
    let best = -1, least = Infinity;
    for (let i = 0; i < frame.n && px < width && py < height; i++) {
      const [hx, hy, size] = stage.seen(frame.rows.x[i], frame.rows.y[i]);
      const off = Math.hypot(hx - px, hy - py);
      if (off < Math.max(size, 12) && off < least) { best = i; least = off; }
    }
    return best;
  }
  function drag(event) {
    const { left, top } = element.getBoundingClientRect(), place = stage.under(event.clientX - left, event.clientY - top);
    if (place) latest.set("pull", { kind: "pull", disc: pulling, x: place[0], y: place[1] });
    pointer = event;
  }
  function release() {
    pulling = null;
    element.classList.remove("pulls");
    latest.delete("pull");
    ask({ kind: "release" });
  }
  element.addEventListener("pointerdown", (event) => {
    tapped = null;
    if (pulling !== null && !event.isPrimary) { // two fingers zoom, also where the first one is on a disc: the view gets it now
      release();
      stage.renderer.domElement.dispatchEvent(new PointerEvent("pointerdown", pointer));
    }
    const i = event.isTrusted && event.isPrimary && event.button === 0 && event.target.tagName === "CANVAS" ? near(event) : -1;
    if (i < 0) return;
    element.focus({ preventScroll: true, focusVisible: false });
    disc.value = scene.discs[i];
    if (tool !== "pull") { tapped = { number: scene.discs[i], x: event.clientX, y: event.clientY }; return; }
    event.stopPropagation();
    event.preventDefault();
    pulling = scene.discs[i];
    element.setPointerCapture(event.pointerId);
    element.classList.add("pulls");
    drag(event);
  }, true);
  element.addEventListener("pointermove", (event) => {
    if (pulling !== null) { event.stopPropagation(); return drag(event); }
    if (!event.buttons) element.classList.toggle("near", near(event) >= 0);
  }, true);
  element.addEventListener("pointerup", (event) => {
    if (tapped && Math.hypot(event.clientX - tapped.x, event.clientY - tapped.y) < 10) (tool === "kick" ? kicked : held)(tapped.number);
    tapped = null;
  }, true);
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) element.addEventListener(name, (event) => {
    if (pulling === null) return;
    event.stopPropagation();
    release();
  }, true);

  const keys = (event) => {
    const turns = { ArrowRight: [0.1, 0, 1], ArrowLeft: [-0.1, 0, 1], ArrowUp: [0, 0.1, 1], ArrowDown: [0, -0.1, 1] };
    const zooms = { "+": [0, 0, 0.9], "-": [0, 0, 1 / 0.9] };
    const does = { " ": () => pause(playing), ArrowRight: () => pace("forward"), ArrowLeft: () => pace("back"), r: again,
      k: () => kicked(Number(disc.value)), h: () => held(Number(disc.value)) };
    const taken = ["SELECT", "INPUT"].includes(event.target.tagName) && event.target.type !== "checkbox";
    if (event.ctrlKey || event.altKey || event.metaKey || taken || (event.key === " " && ["BUTTON", "INPUT"].includes(event.target.tagName))) return;
    const way = zooms[event.key] ?? (event.shiftKey ? turns[event.key] : undefined);
    if (way && stage) stage.turn(...way);
    else if (does[event.key] && frame) does[event.key]();
    else return;
    event.preventDefault();
  };
  const listens = whole ? document : root;
  listens.addEventListener("keydown", keys, true);

  // ---- drawing; where it takes longer than a thirtieth of a second, with fewer pixels
  let slow = 0, drawn = 0;
  function coarsen(now) {
    slow = playing && now - drawn > 40 ? slow + 1 : Math.max(0, slow - 1);
    drawn = now;
    const ratio = stage.renderer.getPixelRatio();
    if (slow < 8 || ratio <= 0.5) return;
    slow = 0;
    stage.renderer.setPixelRatio(Math.max(0.5, 0.7 * ratio));
    stage.resize();
  }
  function resize() {
    if (!stage || !panels.length) return;
    titles.forEach((title, j) => {
      title.hidden = j >= stage.count;
      if (title.hidden) return;
      const [left, top, width] = stage.panel(j);
      Object.assign(title.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: j ? `${stage.panel(j)[3]}px` : "" });
      if (j) Object.assign(title.style, { borderLeftWidth: left ? "1px" : 0, borderTopWidth: top ? "1px" : 0 });
    });
    stage.resize();
  }
  const sized = new ResizeObserver(resize);
  sized.observe(element);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const repaint = () => { if (stage) { stage.paint(panels); arrows?.material.color.set(tone("push")); } };
  dark.addEventListener("change", repaint);
  const theme = new MutationObserver(repaint);
  theme.observe(document.body, { attributeFilter: ["data-jp-theme-light"] });
  let alive = true, written = 0, unwritten = false;
  requestAnimationFrame(function each(now) {
    if (!alive) return;
    requestAnimationFrame(each);
    pump(now);
    if (!frame || !panels.length) return;
    if (unwritten && (now - written > 120 || !playing)) { unwritten = false; written = now; write(); }
    if (!stage?.stale) return;
    stage.stale = false;
    unwritten = true;
    draw();
    coarsen(now);
    stats.frames += 1;
    if (stats.asked) { stats.slider.push(performance.now() - stats.asked); stats.asked = 0; }
  });
  if (whole) globalThis.discs = { stats, get idle() { return !waiting && !queue.length && !latest.size; }, get panels() { return panels; }, get stage() { return stage; }, get frame() { return frame; }, get scene() { return scene; } };
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) pause(true);
  send({ kind: "open" });
  return () => { // the cell or the page is gone
    alive = false;
    sized.disconnect();
    dark.removeEventListener("change", repaint);
    theme.disconnect();
    listens.removeEventListener("keydown", keys, true);
    stage?.close();
    root.remove();
  };
}

export default { render };
