// A robot in 3-D on a plain canvas; a second, pale one is the ghost. The wheel is left to the page.
function view(stage, scene) {
  const DEPTH = -0.05, COLOURS = { "00": "#8c8c8c", "10": "#0072b2", "01": "#d55e00", "11": "#cc79a7" };
  const LIMB = "#333333", PALE = "#0072b2", STANDS = "#009e73";
  const VIEWS = { side: [0, 0.12], oblique: [-0.5, 0.22], front: [-1.5708, 0.1], above: [-0.5, 1.2] };
  const canvas = stage.querySelector("canvas"), context = canvas.getContext("2d");
  const slider = stage.querySelector("input"), clock = stage.querySelector("output");
  const button = stage.querySelector("[data-do=play]"), speed = stage.querySelector("select");
  const centre = scene.centre, size = scene.size, times = scene.time, calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  let [turn, tilt] = VIEWS.oblique, far = 1.8 * size, frame = 0, playing = !calm, before = null, clockwork = 0;

  function project(p) { // forward, left, up [m] -> pixels and distance
    const x = p[0] - centre[0], y = p[1], z = p[2] - centre[1];
    const c = Math.cos(turn), s = Math.sin(turn), ct = Math.cos(tilt), st = Math.sin(tilt);
    const right = c * x + s * y, away = -s * x + c * y;
    const up = ct * z + st * away, deep = far + ct * away - st * z;
    const scale = 1.25 * Math.min(canvas.width, canvas.height) / Math.max(deep, 0.05);
    return [canvas.width / 2 + scale * right, canvas.height / 2 - scale * up, deep, scale];
  }

  function bar(list, a, b, y, width, colour, pale) {
    const p = project([a[0], y, a[1]]), q = project([b[0], y, b[1]]);
    list.push({ deep: (p[2] + q[2]) / 2 + (pale ? 10 : 0), draw() {
      context.globalAlpha = pale ? 0.3 : 1;
      context.strokeStyle = colour; context.lineCap = "round";
      context.lineWidth = Math.max(1, width * (p[3] + q[3]) / 2);
      context.beginPath(); context.moveTo(p[0], p[1]); context.lineTo(q[0], q[1]); context.stroke();
      context.globalAlpha = 1;
    } });
  }

  function ball(list, a, y, radius, colour, pale) { // a stroke of no length would not be drawn
    const p = project([a[0], y, a[1]]);
    list.push({ deep: p[2] - 0.01 + (pale ? 10 : 0), draw() {
      context.globalAlpha = pale ? 0.3 : 1;
      context.fillStyle = colour; context.beginPath();
      context.arc(p[0], p[1], Math.max(2, radius * p[3]), 0, 2 * Math.PI); context.fill();
      context.globalAlpha = 1;
    } });
  }

  function line(points, colour, width) {
    context.strokeStyle = colour; context.lineWidth = width; context.beginPath();
    points.map(project).forEach((p, i) => (i ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
    context.stroke();
  }

  function ground() {
    const low = Math.floor(scene.range[0] - 1), high = Math.ceil(scene.range[1] + 1);
    const [places, heights] = scene.ground, last = places.length - 1;
    const height = (x) => {
      const i = Math.min(Math.max(places.findIndex((p) => p >= x), 1), last);
      return heights[i - 1] + (heights[i] - heights[i - 1]) * (x - places[i - 1]) / (places[i] - places[i - 1]);
    };
    const along = places.map((x, i) => [x, heights[i]]).filter(([x]) => x > low && x < high);
    const path = [[low, height(low)], ...along, [high, height(high)]];
    for (let x = low; x <= high; x += 0.25) line([[x, -0.75, height(x)], [x, 0.75, height(x)]], "#d9d9d9", 1);
    for (let y = -0.75; y <= 0.75; y += 0.25) line(path.map(([x, z]) => [x, y, z]), "#d9d9d9", 1);
    for (const [xs, zs] of scene.obstacles) {
      for (const y of [-0.75, 0.75]) line(xs.map((x, i) => [x, y, zs[i]]), "#8c8c8c", 1);
      xs.forEach((x, i) => line([[x, -0.75, zs[i]], [x, 0.75, zs[i]]], "#8c8c8c", 1));
    }
    scene.motions.forEach((r, i) => line(r.centres.map((c) => [c[0], 0, c[1]]), i ? PALE : "#8c8c8c", 1));
  }

  function leg(list, robot, name, at, pale) {
    const [hip, knee, foot, mount, pin] = ["hip", "knee", "foot", "mount", "pin"].map((n) => at[`${name}/${n}`]);
    const long = Math.hypot(pin[0] - mount[0], pin[1] - mount[1]), share = scene.cylinder / long;
    const end = [0, 1].map((i) => mount[i] + share * (pin[i] - mount[i]));
    const stands = robot.stands[name][frame];
    bar(list, hip, knee, 0, 0.034, pale ? PALE : LIMB, pale);
    bar(list, knee, foot, 0, 0.026, pale ? PALE : LIMB, pale);
    if (!pale) {
      bar(list, mount, pin, DEPTH, 0.010, "#999999");
      bar(list, mount, end, DEPTH, 0.025, COLOURS[robot.valves[name][frame]]);
    }
    ball(list, foot, 0, stands ? 0.03 : 0.016, stands ? STANDS : pale ? PALE : LIMB, pale);
  }

  function draw() {
    const box = canvas.getBoundingClientRect(), sharp = window.devicePixelRatio || 1, list = [];
    canvas.width = box.width * sharp; canvas.height = box.height * sharp;
    ground();
    scene.motions.forEach((robot, i) => {
      const at = {};
      for (const name in robot.points) at[name] = robot.points[name][frame];
      const [front, rear] = [scene.legs[0], scene.legs[scene.legs.length - 1]].map((n) => at[`${n}/hip`]);
      bar(list, front, rear, 0, 0.09, i ? PALE : "#555555", i > 0);
      scene.legs.forEach((name) => leg(list, robot, name, at, i > 0));
    });
    list.sort((a, b) => b.deep - a.deep).forEach((part) => part.draw());
    slider.value = frame; clock.textContent = `${times[frame].toFixed(3)} s`;
    slider.setAttribute("aria-valuetext", clock.textContent);
  }

  function tick(now) {
    if (playing && before !== null) {
      const span = times[times.length - 1] - times[0];
      clockwork = (clockwork + (now - before) / 1000 * +speed.value) % (span + 0.4 * +speed.value);
      go(times[0] + Math.min(clockwork, span));
    }
    before = now;
    requestAnimationFrame(tick);
  }

  function go(t) { const i = times.findIndex((s) => s >= t - 1e-9); frame = i < 0 ? times.length - 1 : i; draw(); }
  function hold(t) { play(false); go(t); clockwork = times[frame] - times[0]; }
  function play(on) { playing = on; button.textContent = on ? "Pause" : "Play"; }
  function nearer(by) { far = Math.min(8 * size, Math.max(0.6 * size, far * by)); draw(); }
  function look(name) { [turn, tilt] = VIEWS[name]; draw(); }

  slider.max = times.length - 1;
  slider.oninput = () => hold(times[+slider.value]);
  const actions = { play: () => play(!playing), nearer: () => nearer(0.8), farther: () => nearer(1.25) };
  stage.querySelectorAll("[data-do]").forEach((b) => { b.onclick = actions[b.dataset.do] || (() => look(b.dataset.do)); });
  canvas.onpointerdown = (e) => { if (e.pointerType !== "touch") canvas.setPointerCapture(e.pointerId); };
  canvas.onpointermove = (e) => {
    if (!e.buttons) return;
    turn += 0.008 * e.movementX; tilt = Math.min(1.5, Math.max(-0.1, tilt + 0.008 * e.movementY)); draw();
  };
  canvas.addEventListener("wheel", (e) => { // with Ctrl only: alone it scrolls the page
    if (e.ctrlKey) { e.preventDefault(); nearer(Math.exp(0.002 * e.deltaY)); }
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (turns) { turn += turns[0]; tilt = Math.min(1.5, Math.max(-0.1, tilt + turns[1])); draw(); }
    else if (e.key === "+" || e.key === "-") nearer(e.key === "+" ? 0.8 : 1.25);
    else return;
    e.preventDefault();
  });
  document.addEventListener("moment", (e) => { if (!playing) hold(e.detail); });
  window.addEventListener("resize", draw); window.addEventListener("beforeprint", draw);
  play(playing); draw(); requestAnimationFrame(tick);
}
