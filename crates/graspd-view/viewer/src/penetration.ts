// Where the hand is inside the object: read, pixel by pixel, from a coarse grid of the object's signed distance.
import {
  Data3DTexture, DoubleSide, LinearFilter, MeshStandardMaterial, RedFormat, ShaderMaterial, UnsignedByteType, Vector3,
} from "three";
import type { Data, FieldDescription } from "./format";

/** Depths from which the colour begins to change and at which it is full [m]. */
const FROM = 0.0003;
const FULL = 0.0025;

const SAMPLE = /* glsl */ `
uniform highp sampler3D distanceField;
uniform vec3 fieldOrigin;
uniform vec3 fieldSize;
uniform vec3 fieldDims;
uniform float fieldRange;
uniform float showPenetration;
varying vec3 placeInObject;
float penetrationDepth() {
  vec3 share = (placeInObject - fieldOrigin) / fieldSize;
  if (any(lessThan(share, vec3(0.0))) || any(greaterThan(share, vec3(1.0)))) return 0.0;
  // Samples stand in the middle of texels.
  vec3 place = (share * (fieldDims - 1.0) + 0.5) / fieldDims;
  return max(0.0, (1.0 - 2.0 * texture(distanceField, place).r) * fieldRange);
}
float penetrationLevel() {
  return showPenetration * smoothstep(${FROM}, ${FULL}, penetrationDepth());
}
vec3 penetrationColor(float level) {
  return mix(vec3(0.95, 0.25, 0.55), vec3(0.55, 0.0, 0.35), level);
}`;

export class Penetration {
  private readonly uniforms;

  constructor(data: Data, field: FieldDescription) {
    const texture = new Data3DTexture(data.unsigned(field.samples) as Uint8Array<ArrayBuffer>, ...field.dims);
    texture.format = RedFormat;
    texture.type = UnsignedByteType;
    texture.minFilter = LinearFilter;
    texture.magFilter = LinearFilter;
    texture.unpackAlignment = 1;
    texture.needsUpdate = true;
    const dims = new Vector3(...field.dims);
    this.uniforms = {
      distanceField: { value: texture },
      fieldOrigin: { value: new Vector3(...field.origin) },
      fieldSize: { value: dims.clone().subScalar(1).multiply(new Vector3(...field.spacing)) },
      fieldDims: { value: dims },
      fieldRange: { value: field.range },
      showPenetration: { value: 1 },
    };
  }

  get isShown(): boolean {
    return this.uniforms.showPenetration.value > 0;
  }

  show(shown: boolean): void {
    this.uniforms.showPenetration.value = shown ? 1 : 0;
  }

  /** Makes a hand's material redden inside the object. */
  colour(material: MeshStandardMaterial): void {
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", "#include <common>\nvarying vec3 placeInObject;")
        .replace("#include <project_vertex>", "#include <project_vertex>\nplaceInObject = (modelMatrix * vec4(transformed, 1.0)).xyz;");
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", "#include <common>\n" + SAMPLE)
        .replace(
          "#include <color_fragment>",
          `#include <color_fragment>
          float level = penetrationLevel();
          if (level > 0.0) diffuseColor.rgb = mix(diffuseColor.rgb, penetrationColor(level), min(1.0, 0.35 + level));`,
        );
    };
  }

  /** Draws the part of the hand that is inside the object over everything else. */
  overlay(): ShaderMaterial {
    return new ShaderMaterial({
      uniforms: this.uniforms,
      transparent: true,
      depthTest: false,
      depthWrite: false,
      side: DoubleSide,
      vertexShader: /* glsl */ `
        varying vec3 placeInObject;
        varying vec3 normalInView;
        void main() {
          vec4 place = modelMatrix * vec4(position, 1.0);
          placeInObject = place.xyz;
          normalInView = normalMatrix * normal;
          gl_Position = projectionMatrix * viewMatrix * place;
        }`,
      fragmentShader: /* glsl */ `
        ${SAMPLE}
        varying vec3 normalInView;
        void main() {
          float level = penetrationLevel();
          if (level <= 0.0) discard;
          float shade = 0.65 + 0.35 * abs(normalize(normalInView).z);
          gl_FragColor = vec4(penetrationColor(level) * shade, 0.3 + 0.5 * level);
        }`,
    });
  }
}
