// Skinned hands, moved by the joints of the rig's hands.
//
// As rhot/hand_mesh/skinned_hand.py: a bone of the mesh is where the joint is, turned so that it runs
// as the joint's own bone does; thickness goes with the whole hand's size.

import { Color, GLTFLoader, MeshStandardMaterial, Quaternion, Vector3 } from "./vendor/three.min.js";

const SKIN = new Color(0.87, 0.62, 0.48);
// As in the rig's page: what is carried on, and seen by no camera now.
const PREDICTED = new Color(0.55, 0.55, 0.6);
const PHALANGES = ["proximal", "intermediate", "distal"];

// WebXR's name of an OpenXR joint: index_proximal -> index-finger-phalanx-proximal.
export function webxrName(joint) {
  if (joint === "wrist") return joint;
  const [digit, bone] = joint.split("_");
  const finger = { thumb: "thumb", little: "pinky-finger" }[digit] ?? `${digit}-finger`;
  return PHALANGES.includes(bone) ? `${finger}-phalanx-${bone}` : `${finger}-${bone}`;
}

// The joint at the end of a joint's bone; null of the wrist and of tips.
function childOf(joint, joints) {
  return joint === "wrist" || joint.endsWith("_tip") ? null : joints[joints.indexOf(joint) + 1];
}

export class Hand {
  // joints: the names of a pose's joints, in its order; group: what the hand hangs on.
  constructor(name, joints, group, changed) {
    this.name = name;
    this.joints = joints;
    this.mesh = null;
    this.seen = false;
    new GLTFLoader().load(`xr/${name}.glb`, (file) => {
      this.#take(file.scene, group);
      changed();
    });
  }

  #take(scene, group) {
    this.bones = new Map();
    this.rest = new Map();
    scene.traverse((node) => {
      if (node.isSkinnedMesh) this.mesh = node;
      if (node.isBone) {
        this.bones.set(node.name, node);
        this.rest.set(node.name, { at: node.position.clone(), turn: node.quaternion.clone() });
      }
    });
    this.mesh.material = new MeshStandardMaterial({ color: SKIN, roughness: 0.7 });
    // Its bounds are those of the pose in the file.
    this.mesh.frustumCulled = false;
    this.root = scene;
    this.root.visible = false;
    group.add(scene);
  }

  // pose: a HandPose, or null where the hand is not seen.
  show(pose) {
    this.seen = pose !== null;
    if (this.mesh === null) return;
    this.root.visible = this.seen;
    if (!this.seen) return;
    const joints = new Map(pose.joints.map((joint, k) => [this.joints[k], joint]));
    const names = this.joints.filter((name) => name !== "palm");
    let ours = 0;
    let meshes = 0;
    let turn = new Quaternion();
    for (const name of names) {
      const joint = joints.get(name);
      const at = new Vector3(...joint.position_m);
      const own = quaternion(joint.orientation_wxyz);
      const child = childOf(name, names);
      if (child !== null) {
        const rest = this.rest.get(webxrName(name));
        const bone = new Vector3(...joints.get(child).position_m).sub(at);
        const drawn = this.rest.get(webxrName(child)).at.clone().sub(rest.at);
        ours += bone.length();
        meshes += drawn.length();
        bone.applyQuaternion(own.clone().invert()).normalize();
        drawn.applyQuaternion(rest.turn.clone().invert()).normalize();
        turn = new Quaternion().setFromUnitVectors(drawn, bone);
      } else if (name === "wrist") {
        turn = new Quaternion();
      }
      // A tip keeps the turn of the bone that ends there.
      const moved = this.bones.get(webxrName(name));
      moved.position.copy(at);
      moved.quaternion.copy(own.multiply(turn));
    }
    for (const bone of this.bones.values()) bone.scale.setScalar(ours / meshes);
    const guessed = pose.joints.every((joint) => joint.source === "predicted");
    this.mesh.material.color.copy(guessed ? PREDICTED : SKIN);
  }
}

export function quaternion([w, x, y, z]) {
  return new Quaternion(x, y, z, w);
}
