// Alignment of the rig with the room: three points of the rig, touched.

import { GOOD_M, align } from "./align.js";

const mm = (metres) => `${(1000 * metres).toFixed(0)} mm`;

export class Alignment {
  // fingerTip() is the tracked index finger's tip in the rig frame, or null.
  constructor(panel, view, fingerTip) {
    this.panel = panel;
    this.view = view;
    this.fingerTip = fingerTip;
    this.running = false;
    this.done = false;
    this.text = "";
  }

  begin() {
    this.rig = [];
    this.room = [];
    try {
      this.known = this.panel.knownPoints();
      this.running = true;
      this.#say(this.#next());
    } catch (error) {
      this.running = false;
      this.#say(error.message);
    }
  }

  // Somebody touched a point of the room, [x, y, z] in its floor's frame.
  touch(roomPoint) {
    if (!this.running) return;
    const rigPoint = this.known === null ? this.fingerTip() : this.known[this.rig.length];
    if (rigPoint === null) {
      this.#say("the index finger's tip is not seen; hold it before the cameras, then touch it again");
      return;
    }
    this.rig.push(rigPoint);
    this.room.push(roomPoint);
    if (this.rig.length < 3) {
      this.#say(this.#next());
      return;
    }
    this.running = false;
    try {
      this.#apply(align(this.rig, this.room));
    } catch (error) {
      this.#say(`${error.message}; squeeze to begin anew`);
    }
  }

  #apply({ rotation, translation, residuals_m, rms_m }) {
    const rows = rotation.flatMap((row, i) => [...row, translation[i]]);
    this.done = true;
    this.result = { rows: [...rows, 0, 0, 0, 1], rms_m };
    this.view.place(this.result.rows);
    this.view.framed = true;
    const worst = Math.max(...residuals_m);
    const verdict = worst > GOOD_M ? "one point was not where it should be; squeeze to try again" : "squeeze to do it again";
    this.#say(`aligned to ${mm(rms_m)} (${mm(worst)} at most); ${verdict}`);
  }

  #next() {
    const what =
      this.known === null ? "the tip of the tracked index finger" : `the rig's point ${this.known[this.rig.length].join(", ")} m`;
    return `touch ${this.rig.length + 1} of 3: ${what}, then press the trigger or pinch`;
  }

  #say(text) {
    this.text = text;
    this.panel.alignment(text);
    this.view.changed();
  }
}
