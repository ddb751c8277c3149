"use strict";
const unfold = () => {
  const target = document.getElementById(location.hash.slice(1));
  for (let one = target; one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
  target?.querySelector("details")?.setAttribute("open", "");
  target?.scrollIntoView();
};
addEventListener("hashchange", unfold);
if (location.hash) unfold();
for (const player of document.querySelectorAll(".player:has(input)")) {
  const slider = player.querySelector("input"), play = player.querySelector("button");
  const when = player.querySelector(".when"), times = JSON.parse(player.dataset.times);
  const parts = player.querySelectorAll("[data-frame]");
  let timer = 0;
  const show = () => {
    for (const part of parts) part.classList.toggle("off", part.dataset.frame !== slider.value);
    when.textContent = times[slider.value];
    slider.setAttribute("aria-valuetext", when.textContent);
  };
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    play.textContent = "Play";
  };
  const step = () => {
    slider.value = (Number(slider.value) + 1) % times.length;
    show();
  };
  slider.addEventListener("input", () => { stop(); show(); });
  play.addEventListener("click", () => {
    if (timer) return stop();
    play.textContent = "Stop";
    timer = setInterval(step, 600);
  });
  addEventListener("beforeprint", () => { stop(); slider.value = slider.defaultValue; show(); });
  player.querySelector(".controls").hidden = false;
}
