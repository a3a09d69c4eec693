"use strict";
// Discs in three dimensions, for the page of a run (view.js) and for the lab (compare/lab): z is up, the plane is z = 0; d_1 along the
// axle, the spoke d_3 = cos(theta) e_z + sin(theta) J d_1. One canvas, a strip of it for each panel, one camera.
//
// element: what the canvas is put into. count: panels. radius: of the drawn discs. style: colours {ink, signed, unsigned}.
// tone: the colour of a name in the light or the dark page. live: frames are to come quickly, one after the other. Throws where the browser shows no WebGL.
function makeStage({ element, count, radius: R, style, tone, live = false }) {
  // what is live is drawn with fewer corners, and without smooth edges where no graphics card helps
  const renderer = new THREE.WebGLRenderer({ antialias: !live || !drawnBySoftware(), preserveDrawingBuffer: !live });
  const around = live ? 24 : 48;
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.setScissorTest(true);
  renderer.domElement.setAttribute("aria-hidden", "true");
  element.prepend(renderer.domElement);
  const camera = new THREE.PerspectiveCamera(30, 1, 0.01, 100);
  camera.up.set(0, 0, 1);
  const orbit = new THREE.OrbitControls(camera, renderer.domElement);
  orbit.maxPolarAngle = Math.PI / 2 - 0.02;
  // plain: a colour for discs without a value. stale: to be drawn again. moved: by the reader, then a new size of the window leaves the direction
  const stage = { renderer, camera, orbit, count, plain: new THREE.Color("#9a9a9a"), stale: true, moved: false };
  orbit.addEventListener("change", () => { stage.stale = true; });
  orbit.addEventListener("start", () => { stage.moved = true; });

  // ---- panels side by side or, on a tall stage, one above the other: [left, top, width, height] in pixels
  function panel(j) {
    const width = element.clientWidth, height = element.clientHeight, tall = height > width;
    return tall ? [0, j * height / stage.count, width, height / stage.count] : [j * width / stage.count, 0, width / stage.count, height];
  }
  function toward(a, e) { return new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)); }

  // ---- what is to be seen: the contact points of discs, [x, y] of each
  let places = [], middle = [0, 0], reach = 1;
  function show(points) {
    const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
    const low = [Math.min(...xs) - 1.1 * R, Math.min(...ys) - 1.1 * R], high = [Math.max(...xs) + 1.1 * R, Math.max(...ys) + 1.1 * R];
    middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    reach = Math.hypot(high[0] - low[0], high[1] - low[1]) / 2;
    places = points.flatMap(([x, y]) => [-1, 1].flatMap((side) =>
      [[side, 0, 0], [0, side, 0], [0, 0, 1 + side]].map(([a, b, c]) => new THREE.Vector3(x + a * R, y + b * R, c * R))));
    Object.assign(camera, { near: reach / 100, far: 100 * reach });
    camera.updateProjectionMatrix();
  }
  // the distance from which all of it is seen along a direction, the point looked at, and the share of the height it fills
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
  function home() {
    const tall = panel(0)[3] > panel(0)[2];
    const best = (tall ? [[-1.05, 0.5], [-0.5, 0.7], [-0.2, 0.8], [-1.4, 0.9]] : [[-1.05, 0.5]]).map(([a, e]) => fitted(a, e))
      .reduce((one, other) => (other.filled > one.filled ? other : one));
    orbit.target.copy(best.target);
    camera.position.copy(best.target).addScaledVector(best.back, best.far);
    orbit.update();
    stage.moved = false;
  }
  function turn(a, e, near) { // by keys
    const from = camera.position.clone().sub(orbit.target), far = from.length();
    const now = [Math.atan2(from.y, from.x) + a, Math.min(Math.max(Math.asin(from.z / far) + e, 0.02), 1.55)];
    camera.position.copy(orbit.target).addScaledVector(toward(...now), far * near);
    orbit.update();
    stage.moved = stage.stale = true;
  }

  // ---- shapes
  function bar(length, width, thick, angle) { // from the hub, lying in the disc's plane; the disc's axle is the x axis, z is up
    return new THREE.BoxGeometry(thick, width, length).translate(0, 0, length / 2).rotateX(-angle);
  }
  const thick = 0.05 * R;
  const rim = new THREE.TorusGeometry(R, 0.022 * R, live ? 4 : 6, around).rotateY(Math.PI / 2);
  const shapes = {
    disc: new THREE.CylinderGeometry(R, R, thick, around).rotateZ(Math.PI / 2),
    cross: THREE.mergeGeometries([rim, ...[1, 2, 3].map((j) => bar(0.97 * R, 0.05 * R, 1.5 * thick, j * Math.PI / 2))]),
    mark: THREE.mergeGeometries([bar(0.97 * R, 0.15 * R, 1.9 * thick, 0), new THREE.CylinderGeometry(0.12 * R, 0.12 * R, 2.2 * thick, 20).rotateZ(Math.PI / 2)]),
    rod: new THREE.CylinderGeometry(0.07 * R, 0.07 * R, 1, live ? 6 : 12).rotateZ(Math.PI / 2),
  };
  function many(scene, shape, material, count) {
    const mesh = new THREE.InstancedMesh(shape, material, count);
    mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
    mesh.frustumCulled = false;
    scene.add(mesh);
    return mesh;
  }
  // n discs and the rod through them, closed for a ring; lines: positions of the ends of line segments on the plane
  function build(n, ring, lines) {
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
    const dark = new THREE.MeshLambertMaterial({ color: style.ink });
    const parts = {
      disc: many(scene, shapes.disc, new THREE.MeshLambertMaterial(), n),
      cross: many(scene, shapes.cross, dark, n),
      mark: many(scene, shapes.mark, dark, n),
      rod: many(scene, shapes.rod, new THREE.MeshLambertMaterial(), n - 1 + ring),
    };
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(lines, 3));
    const tracks = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    tracks.frustumCulled = false;
    scene.add(tracks);
    return { n, scene, parts, tracks, grid, step };
  }
  function drop({ parts, tracks, grid }) { // free what it has on the graphics card
    for (const part of Object.values(parts)) { part.material.dispose(); part.dispose(); }
    for (const lines of [tracks, grid]) { lines.geometry.dispose(); lines.material.dispose(); }
  }
  function paint(panels) { // in the colours of the light or the dark page
    renderer.setClearColor(tone("back"));
    for (const { grid, tracks, parts } of panels) {
      grid.material.color.set(tone("grid"));
      tracks.material.color.set(tone("track"));
      parts.rod.material.color.set(tone("rod"));
    }
    stage.stale = true;
  }

  // ---- discs where they are: x, y, axle, theta and the colour are functions of the number of a disc
  const matrix = new THREE.Matrix4(), e1 = new THREE.Vector3(), e2 = new THREE.Vector3(), e3 = new THREE.Vector3();
  function pose({ n, parts }, { x, y, axle, theta, tint }) {
    for (let i = 0; i < n; i++) {
      const a = axle(i), turned = theta(i);
      e1.set(Math.cos(a), Math.sin(a), 0);
      e3.set(-Math.sin(a) * Math.sin(turned), Math.cos(a) * Math.sin(turned), Math.cos(turned));
      e2.crossVectors(e3, e1);
      matrix.makeBasis(e1, e2, e3).setPosition(x(i), y(i), R);
      for (const name of ["disc", "cross", "mark"]) parts[name].setMatrixAt(i, matrix);
      parts.disc.setColorAt(i, tint(i));
    }
    for (let i = 0; i < parts.rod.count; i++) {
      const j = (i + 1) % n, x0 = x(i), y0 = y(i), dx = x(j) - x0, dy = y(j) - y0;
      const length = Math.hypot(dx, dy) || 1e-9;
      e1.set(dx, dy, 0);
      e2.set(-dy / length, dx / length, 0);
      e3.set(0, 0, 1);
      parts.rod.setMatrixAt(i, matrix.makeBasis(e1, e2, e3).setPosition(x0 + dx / 2, y0 + dy / 2, R));
    }
    for (const part of Object.values(parts)) part.instanceMatrix.needsUpdate = true;
    parts.disc.instanceColor.needsUpdate = true;
  }
  // ---- rods between two points of space, as arrows of forces are drawn with
  function rods(scene, count, thick) {
    const mesh = many(scene, shapes.rod, new THREE.MeshLambertMaterial(), count);
    mesh.thick = thick;
    return mesh;
  }
  function lay(mesh, i, from, to) {
    const way = to.map((value, k) => value - from[k]), length = Math.hypot(...way);
    if (!(length > 1e-9)) matrix.makeScale(0, 0, 0);
    else {
      e1.set(...way);
      e2.set(0, 0, 1).cross(e1);
      if (e2.length() < 1e-6 * length) e2.set(0, 1, 0);
      e2.normalize().multiplyScalar(mesh.thick);
      e3.crossVectors(e1, e2).normalize().multiplyScalar(mesh.thick);
      matrix.makeBasis(e1, e2, e3).setPosition(...from.map((value, k) => value + way[k] / 2));
    }
    mesh.setMatrixAt(i, matrix);
    mesh.instanceMatrix.needsUpdate = true;
  }

  // ---- the pointer, in pixels of the first panel: where a disc's hub and rim are seen, and the point of the plane z = R below it
  function seen(x, y) {
    const [left, top, width, height] = panel(0);
    camera.updateMatrixWorld();
    const pixel = (z) => { const p = new THREE.Vector3(x, y, z).project(camera); return [left + width * (p.x + 1) / 2, top + height * (1 - p.y) / 2]; };
    const hub = pixel(R), rim = pixel(2 * R);
    return [...hub, Math.hypot(rim[0] - hub[0], rim[1] - hub[1])];
  }
  function under(px, py) {
    const [left, top, width, height] = panel(0);
    camera.updateMatrixWorld();
    const way = new THREE.Vector3(2 * (px - left) / width - 1, 1 - 2 * (py - top) / height, 0.5).unproject(camera).sub(camera.position);
    const share = (R - camera.position.z) / way.z;
    return share > 0 && share * way.length() < camera.far ? [camera.position.x + share * way.x, camera.position.y + share * way.y] : null;
  }
  function resize() {
    renderer.setSize(element.clientWidth, element.clientHeight, false);
    const [, , width, height] = panel(0);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    if (!stage.moved) home();
    stage.stale = true;
  }
  function render(panels) {
    panels.forEach(({ scene }, j) => {
      const [left, top, width, height] = panel(j), place = [left, element.clientHeight - top - height, width, height];
      renderer.setViewport(...place);
      renderer.setScissor(...place);
      renderer.render(scene, camera);
    });
  }

  // ---- colour: from low to high along the stops
  function scale(name, low, high) {
    const signed = name === "theta" || name === "omega";
    if (signed) { high = Math.max(high, -low) || 1; low = -high; }
    if (high - low < 1e-6 * Math.abs(high) + 1e-30) { low -= 0.5; high += 0.5; }
    return { low, high, stops: (signed ? style.signed : style.unsigned).map((c) => new THREE.Color(c)) };
  }
  const mixed = new THREE.Color();
  function colour({ low, high, stops }, value) {
    const p = Math.min(Math.max((value - low) / (high - low), 0), 1) * (stops.length - 1);
    const i = Math.min(Math.floor(p), stops.length - 2);
    return mixed.copy(stops[i]).lerp(stops[i + 1], p - i);
  }
  function legend(canvas, of) { // the scale as a strip
    const pen = canvas.getContext("2d"), width = canvas.width;
    for (let i = 0; i < width; i++) {
      pen.fillStyle = `#${colour(of, of.low + (of.high - of.low) * i / (width - 1)).getHexString()}`;
      pen.fillRect(i, 0, 1, canvas.height);
    }
  }
  function close() {
    orbit.dispose();
    for (const shape of Object.values(shapes)) shape.dispose();
    renderer.dispose();
    renderer.forceContextLoss();
    renderer.domElement.remove();
  }
  return Object.assign(stage, { panel, show, home, turn, build, drop, paint, pose, rods, lay, seen, under, resize, render, scale, colour, legend, close });
}

function drawnBySoftware() {
  const context = document.createElement("canvas").getContext("webgl2"), known = context?.getExtension("WEBGL_debug_renderer_info");
  const name = known ? context.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
