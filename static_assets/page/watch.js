"use strict";
// Says that what the page shows is old when nothing has come for a while, whatever the reason: a
// server that hangs, a network that is silent, a process that has ended. Nobody else could say so.
(() => {
  const OLD = 2000; // [ms] of silence; there is a beat every half second
  const LOOK = 200; // [ms] between two looks
  const STOPS = ["KeyS", "Space"];
  const root = document.documentElement;
  let begun = false; // the arm's program has begun to speak
  let heard = performance.now(); // [ms]
  let notice = null;

  // What comes is read by a worker of viser's and drawn later, on a slow computer much later; it
  // is news as soon as the worker has it.
  const Real = window.Worker;
  window.Worker = class extends Real {
    constructor(...how) {
      super(...how);
      this.addEventListener("message", (event) => {
        if (event.data?.type === "message_batch") heard = performance.now();
      });
    }
  };

  function say(long) {
    if (!notice) {
      notice = document.body.appendChild(document.createElement("div"));
      notice.className = "flinch-old-notice";
      notice.setAttribute("role", "alert");
      notice.append(document.createElement("b"), document.createElement("span"));
      notice.firstChild.textContent = "What you see is old";
    }
    notice.lastChild.textContent = `Nothing has come from the arm ${long}. Stop may not arrive: `
      + "where it matters, use the emergency stop.";
  }

  function look() {
    const beat = document.querySelector("[data-beat]")?.dataset.beat;
    if (beat !== undefined) begun = beat !== "0";
    const silence = performance.now() - heard;
    const mute = document.querySelector('[data-arm="No news"]') !== null; // all but the engine lives
    const old = begun && (silence > OLD || mute);
    root.classList.toggle("flinch-old", old);
    if (old) say(mute && silence < OLD ? "" : `for ${Math.floor(silence / 1000)} s`);
  }

  // what is pressed now would be done when the line is back, whatever is in the way by then
  function hold(event) {
    if (!root.classList.contains("flinch-old")) return;
    if (event.type === "keydown" ? STOPS.includes(event.code) : allowed(event.target)) return;
    event.stopImmediatePropagation();
    event.preventDefault();
  }

  function allowed(target) {
    return target.closest?.("[role=tab]") || target.closest?.("button")?.textContent.trim() === "Stop";
  }

  for (const kind of ["keydown", "pointerdown", "mousedown", "click"]) {
    window.addEventListener(kind, hold, { capture: true });
  }
  setInterval(look, LOOK);
})();
