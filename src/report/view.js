// Arm, cameras and features: drag or arrow keys to turn, wheel to come nearer.
(() => {
  const canvas = document.getElementById("view");
  const scene = JSON.parse(document.getElementById("view-data").textContent);
  const context = canvas.getContext("2d");
  let yaw = 0.8, pitch = 0.45, zoom = 1, now = 0;
  const current = (states) => states[Math.min(now, states.length - 1)];
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const place = ([x, y, z]) => {
    const [u, v, w] = [x - scene.centre[0], y - scene.centre[1], z - scene.centre[2]];
    const right = -Math.sin(yaw) * u + Math.cos(yaw) * v;
    const away = Math.cos(yaw) * u + Math.sin(yaw) * v;
    const up = Math.cos(pitch) * w - Math.sin(pitch) * away;
    const scale = zoom * 0.42 * Math.min(canvas.width, canvas.height) / scene.radius;
    return [canvas.width / 2 + scale * right, canvas.height / 2 - scale * up];
  };
  const path = (points, style, width) => {
    context.beginPath();
    points.map(place).forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.strokeStyle = style;
    context.lineWidth = width;
    context.stroke();
  };
  const dot = (point, radius, style) => {
    const [x, y] = place(point);
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = style;
    context.fill();
  };
  const draw = () => {
    context.clearRect(0, 0, canvas.width, canvas.height);
    scene.tips.forEach((tip) => dot(tip, 2, colour("--line")));
    const others = scene.moves ? [scene.arms[0]] : scene.arms;
    others.forEach((arm) => path(arm, colour("--soft"), 1));
    path(current(scene.arms), colour("--main"), 5);
    current(scene.features).forEach((feature) => dot(feature, 3, colour("--warn")));
    current(scene.cameras).forEach((camera) => {
      camera.lines.forEach((line) => path(line, colour("--good"), 1.5));
      const [x, y] = place(camera.lines[0][0]);
      context.fillStyle = colour("--ink");
      context.font = "14px system-ui, sans-serif";
      context.fillText(camera.name, x + 8, y - 6);
    });
    scene.axes.forEach((axis, index) => path(axis, ["#d33", "#3a3", "#36c"][index], 2));
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
  document.addEventListener("moment", (event) => { now = event.detail; draw(); });
  draw();
})();
