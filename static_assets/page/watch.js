"use strict";
// Says that what the page shows is old when nothing has come for a while, whatever the reason: a
// server that hangs, a network that is silent, a process that has ended. Nobody else could say so.
(() => {
  const OLD = 2000; // [ms] without a beat; they come every half second
  const LOOK = 200; // [ms] between two looks
  const STOPS = ["KeyS", "Space"];
  const root = document.documentElement;
  let beat = null; // none has come yet
  let heard = 0; // [ms]
  let notice = null;

  function say(seconds) {
    if (!notice) {
      notice = document.body.appendChild(document.createElement("div"));
      notice.className = "flinch-old-notice";
      notice.setAttribute("role", "alert");
      notice.append(document.createElement("b"), document.createElement("span"));
      notice.firstChild.textContent = "What you see is old";
    }
    notice.lastChild.textContent = `Nothing has come from Flinch for ${seconds} s. Stop may not `
      + "arrive: where it matters, use the arm's emergency stop.";
  }

  function look() {
    const now = performance.now();
    const told = document.querySelector("[data-beat]")?.dataset.beat;
    if (told === "0") beat = null; // the arm's program is still starting
    else if (told && told !== beat) {
      beat = told;
      heard = now;
    }
    const old = beat !== null && now - heard > OLD;
    root.classList.toggle("flinch-old", old);
    if (old) say(Math.floor((now - heard) / 1000));
  }

  // what is pressed now would be done when the line is back, whatever is in the way by then
  function hold(event) {
    if (!root.classList.contains("flinch-old")) return;
    if (event.type === "keydown" ? STOPS.includes(event.code) : allowed(event.target)) return;
    event.stopImmediatePropagation();
    event.preventDefault();
  }

  function allowed(target) {
    return target.closest?.("[role=tab]") || target.closest?.("button")?.textContent === "Stop";
  }

  for (const kind of ["keydown", "pointerdown", "mousedown", "click"]) {
    window.addEventListener(kind, hold, { capture: true });
  }
  document.addEventListener("visibilitychange", () => {
    heard = performance.now(); // a page in the background is drawn no more, and hears nothing
  });
  setInterval(look, LOOK);
})();
