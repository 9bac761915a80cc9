// A robot in 3-D on a plain canvas: drag to turn, wheel to come nearer, space to play and pause.
function view(canvas, scene) {
  const DEPTH = -0.05, COLOURS = { "00": "#8c8c8c", "10": "#0072b2", "01": "#d55e00", "11": "#cc79a7" };
  const centre = scene.centre, size = scene.size, context = canvas.getContext("2d");
  const slider = canvas.parentElement.querySelector("input");
  const button = canvas.parentElement.querySelector("button");
  const clock = canvas.parentElement.querySelector("output");
  let turn = -0.5, tilt = 0.22, far = 1.8 * size, frame = 0, playing = true, before = null;

  function project(p) { // forward, left, up [m] -> pixels and distance
    const x = p[0] - centre[0], y = p[1], z = p[2] - centre[1];
    const c = Math.cos(turn), s = Math.sin(turn), ct = Math.cos(tilt), st = Math.sin(tilt);
    const right = c * x + s * y, away = -s * x + c * y;
    const up = ct * z + st * away, deep = far + ct * away - st * z;
    const scale = 1.25 * Math.min(canvas.width, canvas.height) / Math.max(deep, 0.05);
    return [canvas.width / 2 + scale * right, canvas.height / 2 - scale * up, deep, scale];
  }

  function bar(list, a, b, y, width, colour) {
    const p = project([a[0], y, a[1]]), q = project([b[0], y, b[1]]);
    list.push({ deep: (p[2] + q[2]) / 2, draw() {
      context.strokeStyle = colour; context.lineCap = "round";
      context.lineWidth = Math.max(1, width * (p[3] + q[3]) / 2);
      context.beginPath(); context.moveTo(p[0], p[1]); context.lineTo(q[0], q[1]); context.stroke();
    } });
  }

  function line(points, colour, width) {
    context.strokeStyle = colour; context.lineWidth = width; context.beginPath();
    points.map(project).forEach((p, i) => (i ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
    context.stroke();
  }

  function ground() {
    const low = Math.floor(scene.range[0] - 1), high = Math.ceil(scene.range[1] + 1);
    for (let x = low; x <= high; x += 0.25) line([[x, -0.75, 0], [x, 0.75, 0]], "#d9d9d9", 1);
    for (let y = -0.75; y <= 0.75; y += 0.25) line([[low, y, 0], [high, y, 0]], "#d9d9d9", 1);
    line(scene.centres.map((c) => [c[0], 0, c[1]]), "#8c8c8c", 1);
  }

  function leg(list, name, at) {
    const [hip, knee, foot, mount, pin] = ["hip", "knee", "foot", "mount", "pin"].map((n) => at[`${name}/${n}`]);
    const long = Math.hypot(pin[0] - mount[0], pin[1] - mount[1]), share = scene.cylinder / long;
    const end = [0, 1].map((i) => mount[i] + share * (pin[i] - mount[i]));
    bar(list, hip, knee, 0, 0.034, "#333333");
    bar(list, knee, foot, 0, 0.026, "#333333");
    bar(list, mount, pin, DEPTH, 0.010, "#999999");
    bar(list, mount, end, DEPTH, 0.025, COLOURS[scene.valves[name][frame]]);
    if (scene.stands[name][frame]) bar(list, foot, foot, 0, 0.05, "#009e73");
  }

  function draw() {
    const box = canvas.getBoundingClientRect(), sharp = window.devicePixelRatio || 1;
    canvas.width = box.width * sharp; canvas.height = box.height * sharp;
    const at = {}, list = [];
    for (const name in scene.points) at[name] = scene.points[name][frame];
    ground();
    const [front, rear] = [scene.legs[0], scene.legs[scene.legs.length - 1]].map((n) => at[`${n}/hip`]);
    bar(list, front, rear, 0, 0.09, "#555555");
    scene.legs.forEach((name) => leg(list, name, at));
    list.sort((a, b) => b.deep - a.deep).forEach((part) => part.draw());
    slider.value = frame; clock.textContent = `${scene.time[frame].toFixed(3)} s`;
  }

  function tick(now) {
    if (playing && before !== null) {
      const span = scene.time[scene.time.length - 1] - scene.time[0];
      const shown = (view.clock = ((view.clock || 0) + (now - before) / 1000 / scene.slower) % (span + 0.4));
      const until = scene.time[0] + Math.min(shown, span);
      frame = Math.max(0, scene.time.findIndex((t) => t >= until - 1e-9));
      draw();
    }
    before = now;
    requestAnimationFrame(tick);
  }

  function play(on) { playing = on; button.textContent = on ? "pause" : "play"; }
  slider.max = scene.time.length - 1;
  slider.oninput = () => { play(false); frame = +slider.value; view.clock = scene.time[frame] - scene.time[0]; draw(); };
  button.onclick = () => play(!playing);
  canvas.onpointermove = (e) => {
    if (!e.buttons) return;
    turn += 0.008 * e.movementX; tilt = Math.min(1.5, Math.max(-0.1, tilt + 0.008 * e.movementY)); draw();
  };
  canvas.onpointerdown = (e) => canvas.setPointerCapture(e.pointerId);
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault(); far = Math.min(8 * size, Math.max(0.6 * size, far * Math.exp(0.001 * e.deltaY))); draw();
  }, { passive: false });
  document.addEventListener("keydown", (e) => { if (e.key === " ") { e.preventDefault(); play(!playing); } });
  window.addEventListener("resize", draw);
  play(true); draw(); requestAnimationFrame(tick);
}
