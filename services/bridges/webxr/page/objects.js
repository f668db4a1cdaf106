// The rig's objects in their shapes; one that is touched or held is lit.

import {
  AxesHelper,
  BoxGeometry,
  Color,
  CylinderGeometry,
  GLTFLoader,
  Group,
  Mesh,
  MeshStandardMaterial,
  SphereGeometry,
} from "./vendor/three.min.js";
import { quaternion } from "./hands.js";

const BODY = new Color(0.0, 0.35, 0.6);
const TOUCHED = new Color(0.55, 0.3, 0.0);
const HELD = new Color(0.0, 0.45, 0.2);
const DARK = new Color(0, 0, 0);
// What hinders an object whose poses come, by its tracking; elsewhere it is lost.
const HINDERED = {
  unregistered: "its place in the rig is not calibrated",
  rotation_only: "its turn is known, its place is not",
  calibrating: "its tracker is locating itself",
  out_of_range: "out of the lighthouses' view",
};

function geometryOf({ shape, size_m: size = [] }) {
  if (shape === "box") return new BoxGeometry(...size);
  if (shape === "cylinder") return new CylinderGeometry(size[0] / 2, size[0] / 2, size[1], 32);
  return new SphereGeometry(shape === "sphere" ? size[0] / 2 : 0.015, 32, 16);
}

export class RigObject {
  constructor(about, group, changed) {
    this.name = about.name;
    this.state = "";
    this.seen = false;
    this.material = new MeshStandardMaterial({ color: BODY, roughness: 0.5, transparent: true, opacity: 0.8 });
    this.root = new Group();
    this.root.visible = false;
    this.root.add(new AxesHelper(0.04));
    group.add(this.root);
    if (about.mesh) {
      new GLTFLoader().load(`${about.mesh}${location.search}`, (file) => {
        file.scene.traverse((node) => {
          if (node.isMesh) node.material = this.material;
        });
        this.root.add(file.scene);
        changed();
      });
    } else {
      this.root.add(new Mesh(geometryOf(about), this.material));
    }
  }

  // pose: an ObjectPose, or null; contacts: ObjectContacts, or null.
  show(pose, contacts) {
    this.seen = pose !== null && pose.registered && pose.tracking === "ok";
    this.root.visible = this.seen;
    if (!this.seen) {
      const hindered = pose?.tracking !== "lost" && pose?.registered === false ? "unregistered" : pose?.tracking;
      this.state = pose === null ? "waiting for its poses" : (HINDERED[hindered] ?? "lost");
      return;
    }
    this.root.position.set(...pose.position_m);
    this.root.quaternion.copy(quaternion(pose.orientation_wxyz));
    const holder = contacts?.grasps[0]?.hand;
    const toucher = contacts?.contacts.find((contact) => contact.touching)?.hand;
    this.state = holder ? `held, ${holder} hand` : toucher ? `touched, ${toucher} hand` : "seen";
    this.material.emissive.copy(holder ? HELD : toucher ? TOUCHED : DARK);
  }

  dispose() {
    this.root.removeFromParent();
  }
}
