// What three.min.js is made of: npm's three 0.187.0 (MIT, three.LICENSE.txt), bundled by esbuild
// 0.28.2 in a folder with both:
//   npx esbuild three.entry.js --bundle --minify --format=esm --target=es2022 --outfile=three.min.js
export {
  AxesHelper,
  BoxGeometry,
  CanvasTexture,
  Color,
  CylinderGeometry,
  DirectionalLight,
  GridHelper,
  Group,
  HemisphereLight,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  Quaternion,
  Scene,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
export { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
