// The headset: sessions of WebXR, what one touches in them, and the sign that says what to do.

import {
  CanvasTexture,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  SRGBColorSpace,
} from "./vendor/three.min.js";

const MODES = { vr: "immersive-vr", ar: "immersive-ar" };

export class Headset {
  constructor(view, panel, alignment) {
    this.view = view;
    this.panel = panel;
    this.alignment = alignment;
    this.sign = new Sign(view);
    this.#look();
  }

  async #look() {
    if (!isSecureContext) {
      this.panel.why(
        "A headset's view needs https, or this page on the same machine (localhost). The guide says how.",
      );
      return;
    }
    let found = false;
    for (const [kind, mode] of Object.entries(MODES)) {
      if (await navigator.xr?.isSessionSupported(mode).catch(() => false)) {
        found = true;
        this.panel.offer(kind, () => this.#enter(mode));
      }
    }
    if (!found) this.panel.why("No headset here. Open this page in a headset's browser to stand beside the hand.");
  }

  async #enter(mode) {
    try {
      const session = await navigator.xr.requestSession(mode, {
        optionalFeatures: ["local-floor", "hand-tracking"],
      });
      await this.#start(session, mode);
    } catch (error) {
      this.panel.why(`The headset's view cannot be opened: ${error.message}`);
    }
  }

  async #start(session, mode) {
    const { renderer, floor } = this.view;
    // Through an AR headset one sees the room itself.
    floor.visible = mode === MODES.vr;
    renderer.setClearAlpha(mode === MODES.vr ? 1 : 0);
    session.addEventListener("select", (event) => this.#touch(event));
    session.addEventListener("squeeze", () => this.alignment.begin());
    session.addEventListener("end", () => {
      floor.visible = true;
      renderer.setClearAlpha(1);
      this.view.resize();
    });
    // The view's shift for a phone's panel is no headset's.
    this.view.camera.clearViewOffset();
    await renderer.xr.setSession(session);
    if (this.panel.alignsOnEntry) this.alignment.begin();
  }

  // Where the index finger's tip is, or the controller's.
  #touch(event) {
    const space = this.view.renderer.xr.getReferenceSpace();
    const source = event.inputSource;
    const tip = source.hand?.get("index-finger-tip");
    const pose = tip ? event.frame.getJointPose(tip, space) : event.frame.getPose(source.targetRaySpace, space);
    if (pose === null || pose === undefined) return;
    const { x, y, z } = pose.transform.position;
    this.alignment.touch([x, y, z]);
  }

  update() {
    this.sign.show(this.view.renderer.xr.isPresenting ? this.alignment.text : "");
  }
}

// A sign in the room: pages are not seen in a headset.
class Sign {
  constructor(view) {
    this.canvas = Object.assign(document.createElement("canvas"), { width: 1024, height: 192 });
    this.texture = new CanvasTexture(this.canvas);
    this.texture.colorSpace = SRGBColorSpace;
    const material = new MeshBasicMaterial({ map: this.texture, transparent: true });
    this.mesh = new Mesh(new PlaneGeometry(0.8, 0.15), material);
    // At reading distance before who stands in the middle of the room.
    this.mesh.position.set(0, 1.35, -1.1);
    this.mesh.visible = false;
    this.text = "";
    view.scene.add(this.mesh);
  }

  show(text) {
    this.mesh.visible = text !== "";
    if (text === this.text) return;
    this.text = text;
    const context = this.canvas.getContext("2d");
    context.clearRect(0, 0, 1024, 192);
    context.fillStyle = "rgb(28 33 39 / 0.9)";
    context.fillRect(0, 0, 1024, 192);
    context.fillStyle = "#eef1f4";
    context.font = "40px sans-serif";
    let line = "";
    let y = 56;
    for (const word of text.split(" ")) {
      if (context.measureText(`${line}${word}`).width > 980) {
        context.fillText(line, 20, y);
        line = "";
        y += 52;
      }
      line += `${word} `;
    }
    context.fillText(line, 20, y);
    this.texture.needsUpdate = true;
  }
}
