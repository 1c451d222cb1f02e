// Arm, cameras and features: drag or arrow keys to turn, wheel to come nearer.
(() => {
  const canvas = document.getElementById("view");
  const scene = JSON.parse(document.getElementById("view-data").textContent);
  const context = canvas.getContext("2d");
  let yaw = 0.8, pitch = 0.45, zoom = 1, now = 0;
  const current = (states) => states[Math.min(now, states.length - 1)];
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  // Whatever is drawn at any moment, so that the size does not change while it plays.
  const all = [scene.arms, scene.features, [scene.tips], scene.cameras.map((of) => of.flatMap((camera) => camera.lines.flat())), scene.axes]
    .flat(2).filter((point) => point.length === 3);
  const ratio = () => canvas.width / Math.max(1, canvas.clientWidth);
  const turned = ([x, y, z]) => {
    const [u, v, w] = [x - scene.centre[0], y - scene.centre[1], z - scene.centre[2]];
    const away = Math.cos(yaw) * u + Math.sin(yaw) * v;
    return [-Math.sin(yaw) * u + Math.cos(yaw) * v, Math.cos(pitch) * w - Math.sin(pitch) * away];
  };
  // From what is turned to the canvas, filling it but for a margin.
  let fit = { scale: 1, centre: [0, 0] };
  const fitted = () => {
    const points = all.map(turned);
    const range = (axis) => points.reduce(([least, most], point) => [Math.min(least, point[axis]), Math.max(most, point[axis])], [Infinity, -Infinity]);
    const [across, up] = [range(0), range(1)];
    const size = ([least, most]) => Math.max(most - least, 1e-3 * scene.radius);
    const scale = zoom * 0.84 * Math.min(canvas.width / size(across), canvas.height / size(up));
    fit = { scale, centre: [across, up].map(([least, most]) => (least + most) / 2) };
  };
  const place = (point) => {
    const [right, up] = turned(point);
    return [canvas.width / 2 + fit.scale * (right - fit.centre[0]), canvas.height / 2 - fit.scale * (up - fit.centre[1])];
  };
  const path = (points, style, width) => {
    context.beginPath();
    points.map(place).forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.strokeStyle = style;
    context.lineWidth = width * ratio();
    context.stroke();
  };
  const dot = (point, radius, style) => {
    const [x, y] = place(point);
    context.beginPath();
    context.arc(x, y, radius * ratio(), 0, 2 * Math.PI);
    context.fillStyle = style;
    context.fill();
  };
  // Names beside their cameras, each moved down until it covers none before it, with a line to where it belongs.
  const label = (cameras) => {
    const height = 16 * ratio();
    context.font = `600 ${14 * ratio()}px system-ui, sans-serif`;
    const boxes = [];
    const places = cameras.map((camera) => [camera.name, place(camera.lines[0][0])]).sort((a, b) => a[1][1] - b[1][1]);
    places.forEach(([name, [x, y]]) => {
      const width = context.measureText(name).width;
      const box = { name, x: Math.max(0, Math.min(x + 10 * ratio(), canvas.width - width)), y: Math.max(height, y - 6 * ratio()), width, height };
      const covered = (other) => box.x < other.x + other.width && other.x < box.x + box.width && Math.abs(box.y - other.y) < height;
      // From the top down, so that what is below one box is below all before it.
      boxes.forEach((other) => { if (covered(other)) box.y = other.y + height; });
      boxes.push(box);
      boxes.sort((one, other) => one.y - other.y);
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(box.x, box.y - height / 3);
      context.strokeStyle = colour("--soft");
      context.lineWidth = ratio();
      context.stroke();
      context.lineWidth = 4 * ratio();
      context.strokeStyle = colour("--panel");
      context.strokeText(name, box.x, box.y);
      context.fillStyle = colour("--ink");
      context.fillText(name, box.x, box.y);
    });
    canvas.labels = boxes;
  };
  const draw = () => {
    // As many pixels as the screen has.
    const width = Math.max(1, Math.round(canvas.clientWidth * (window.devicePixelRatio || 1)));
    if (canvas.width !== width) {
      canvas.width = width;
      canvas.height = Math.round(0.7 * width);
    }
    fitted();
    context.clearRect(0, 0, canvas.width, canvas.height);
    scene.tips.forEach((tip) => dot(tip, 2, colour("--line")));
    const others = scene.moves ? [scene.arms[0]] : scene.arms;
    others.forEach((arm) => path(arm, colour("--soft"), 1));
    path(current(scene.arms), colour("--main"), 5);
    current(scene.features).forEach((feature) => dot(feature, 3, colour("--warn")));
    current(scene.cameras).forEach((camera) => {
      camera.lines.forEach((line) => path(line, colour("--good"), 1.5));
    });
    scene.axes.forEach((axis, index) => path(axis, ["#d33", "#3a3", "#36c"][index], 2));
    label(current(scene.cameras));
  };
  let held = null;
  canvas.addEventListener("pointerdown", (event) => { held = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  ["pointerup", "pointercancel"].forEach((end) => canvas.addEventListener(end, () => { held = null; }));
  canvas.addEventListener("pointermove", (event) => {
    if (!held) return;
    yaw -= (event.clientX - held[0]) * 0.01;
    pitch = Math.max(-1.5, Math.min(1.5, pitch + (event.clientY - held[1]) * 0.01));
    held = [event.clientX, event.clientY];
    draw();
  });
  canvas.addEventListener("wheel", (event) => { zoom *= Math.exp(-event.deltaY * 0.001); event.preventDefault(); draw(); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!turn) return;
    yaw += turn[0];
    pitch = Math.max(-1.5, Math.min(1.5, pitch + turn[1]));
    event.preventDefault();
    draw();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  addEventListener("resize", draw);
  document.addEventListener("moment", (event) => { now = event.detail; draw(); });
  draw();
})();
