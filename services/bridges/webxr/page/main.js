// Hands and objects of the rig, live: on a desktop with the mouse, in a headset in the room.

import {
  AxesHelper,
  DirectionalLight,
  GridHelper,
  Group,
  HemisphereLight,
  Matrix4,
  OrbitControls,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "./vendor/three.min.js";
import { Alignment } from "./alignment.js";
import { Hand } from "./hands.js";
import { Headset } from "./headset.js";
import { Live } from "./live.js";
import { RigObject } from "./objects.js";
import { Panel } from "./panel.js";

const BACKGROUND = 0x1c2127;
// Where one looks from at first: to the right of the hand, above it, and this side of it.
const FROM = new Vector3(0.12, 0.22, 0.5);

class View {
  constructor() {
    this.renderer = new WebGLRenderer({ canvas: document.getElementById("scene"), antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setClearColor(BACKGROUND, 1);
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType("local-floor");
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(50, 1, 0.02, 50);
    this.camera.position.set(0.3, 1.3, 0.6);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.target.set(0, 0.9, -0.2);
    this.controls.addEventListener("change", () => this.changed());
    this.scene.add(new HemisphereLight(0xffffff, 0x555555, 1.5));
    const sun = new DirectionalLight(0xffffff, 1.3);
    sun.position.set(0.5, 2, 1);
    this.scene.add(sun);
    this.floor = new GridHelper(4, 20, 0x556070, 0x333b45);
    this.scene.add(this.floor);
    // The rig's own frame; everything of the rig hangs on it.
    this.rig = new Group();
    this.rig.matrixAutoUpdate = false;
    this.rig.add(new AxesHelper(0.1));
    this.scene.add(this.rig);
    this.framed = false;
    addEventListener("resize", () => this.resize());
    this.resize();
  }

  changed() {
    this.dirty = true;
  }

  resize() {
    if (this.renderer.xr.isPresenting) return;
    this.camera.aspect = innerWidth / innerHeight;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(innerWidth, innerHeight, false);
    // On a phone held upright the panel covers the top: the hand is moved below it.
    const below = innerWidth <= 600 ? Math.round(innerHeight * 0.15) : 0;
    this.camera.setViewOffset(innerWidth, innerHeight, 0, -below, innerWidth, innerHeight);
    this.changed();
  }

  place(rows) {
    this.rig.matrix.set(...rows);
    this.rig.matrixWorldNeedsUpdate = true;
    this.framed = false;
    this.changed();
  }

  lookAt(rigPoint) {
    const target = new Vector3(...rigPoint).applyMatrix4(this.rig.matrix);
    this.controls.target.copy(target);
    const far = innerWidth < innerHeight ? 1.4 : 1;
    this.camera.position.copy(target).addScaledVector(FROM, far);
    this.controls.update();
    this.framed = true;
    this.changed();
  }
}

const IDENTITY = new Matrix4().identity().transpose().toArray();

class Page {
  constructor() {
    this.view = new View();
    this.panel = new Panel();
    this.hands = new Map();
    this.objects = new Map();
    this.live = new Live();
    this.live.onHello = (hello) => this.#meet(hello);
    this.live.onChange = () => this.view.changed();
    this.alignment = new Alignment(this.panel, this.view, () => this.#fingerTip());
    this.headset = new Headset(this.view, this.panel, this.alignment);
    this.panel.onLook(() => this.#look());
    this.view.renderer.setAnimationLoop(() => this.#draw());
  }

  // Also after the bridge's restart: another rig may have come.
  #meet(hello) {
    if (!this.alignment.done) this.view.place(hello.floor_from_rig.length ? hello.floor_from_rig : IDENTITY);
    for (const name of hello.hands) {
      if (this.hands.has(name)) continue;
      this.hands.set(name, new Hand(name, hello.joints, this.view.rig, () => this.view.changed()));
    }
    for (const one of this.objects.values()) one.dispose();
    this.objects = new Map(
      hello.objects.map((one) => [one.name, new RigObject(one, this.view.rig, () => this.view.changed())]),
    );
  }

  #draw() {
    const presenting = this.view.renderer.xr.isPresenting;
    const now = performance.now();
    if (!presenting) this.view.controls.update();
    // What is lost is hidden a second later, without any message.
    if (!this.view.dirty && !presenting && now - (this.drawnAt ?? 0) < 500) return;
    this.view.dirty = false;
    this.drawnAt = now;
    for (const hand of this.hands.values()) hand.show(this.live.message(`hand/${hand.name}/pose`, now));
    for (const one of this.objects.values()) {
      const topic = `object/${one.name}`;
      one.show(this.live.message(`${topic}/pose`, now), this.live.message(`${topic}/contacts`, now));
    }
    if (!this.view.framed && !presenting) this.#look();
    this.panel.show(this.live, [...this.hands.values()], [...this.objects.values()]);
    this.headset.update();
    this.view.renderer.render(this.view.scene, this.view.camera);
  }

  #look() {
    const seen = [...this.hands.keys()].map((name) => this.#pose(name)).find((pose) => pose !== null);
    if (seen) this.view.lookAt(seen.joints[0].position_m);
  }

  #pose(name) {
    return this.live.message(`hand/${name}/pose`, performance.now());
  }

  #fingerTip() {
    for (const name of this.hands.keys()) {
      const joint = this.#pose(name)?.joints.find((one) => one.name === "index_tip");
      if (joint) return joint.position_m;
    }
    return null;
  }
}

// For tests and for curious people: what is drawn, in the browser's console.
globalThis.rhot = new Page();
