// Plays the pictures of a page: start and stop, a slider, the pace, the space bar and the arrow keys.
(function () {
  "use strict";
  const player = document.querySelector(".player");
  const frames = JSON.parse(player.querySelector("script").textContent);
  const image = player.querySelector("img");
  const [button, slider, pace] = player.querySelectorAll("button, input, select");
  let at = 0, timer = 0;

  function show(number) {
    at = (number + frames.length) % frames.length;
    image.src = frames[at];
    slider.value = at;
  }

  function stop() {
    clearInterval(timer);
    timer = 0;
    button.textContent = "Play";
  }

  function play() {
    clearInterval(timer);
    timer = setInterval(() => show(at + 1), 1000 / Number(pace.value));
    button.textContent = "Pause";
  }

  slider.max = frames.length - 1;
  player.querySelector(".controls").hidden = false;
  button.addEventListener("click", () => (timer ? stop() : play()));
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  pace.addEventListener("change", play);
  addEventListener("keydown", (event) => {
    if (event.target !== document.body) return;
    if (event.key === " ") button.click();
    else if (event.key === "ArrowRight") { stop(); show(at + 1); }
    else if (event.key === "ArrowLeft") { stop(); show(at - 1); }
    else return;
    event.preventDefault();
  });
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) stop(); else play();
})();
