// What the 3D view of a report uses of three.js; bundled into three.min.js, see README.md.
export {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, ColorManagement, DirectionalLight,
  DoubleSide, EdgesGeometry, Group, LinearSRGBColorSpace, LineBasicMaterial, LineSegments, Matrix4,
  Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, PlaneGeometry, Points,
  PointsMaterial, Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
