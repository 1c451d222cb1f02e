// A servo run: plays its moments, or shows the one that is chosen.
(() => {
  const moments = JSON.parse(document.getElementById("moments").textContent);
  const [slider, button, says] = ["moment", "play", "now"].map((id) => document.getElementById(id));
  const seen = [...document.querySelectorAll("svg [data-camera]")];
  const show = () => {
    const moment = moments[slider.value];
    seen.forEach((dot) => {
      const place = moment.pixels[dot.dataset.camera][dot.dataset.feature];
      dot.setAttribute("visibility", place ? "visible" : "hidden");
      if (place) ["cx", "cy"].forEach((name, axis) => dot.setAttribute(name, place[axis]));
    });
    says.textContent = moment.words;
    document.dispatchEvent(new CustomEvent("moment", { detail: Number(slider.value) }));
  };
  let timer = null;
  const stop = () => {
    clearInterval(timer);
    timer = null;
    button.textContent = "play";
  };
  button.addEventListener("click", () => {
    if (timer) return stop();
    if (slider.value === slider.max) slider.value = 0;
    button.textContent = "pause";
    // Ten seconds for all of it, and no moment faster than the eye.
    timer = setInterval(() => {
      slider.value = Number(slider.value) + 1;
      show();
      if (slider.value === slider.max) stop();
    }, Math.max(20, Math.min(500, 10000 / moments.length)));
  });
  slider.addEventListener("input", () => { stop(); show(); });
  show();
})();
