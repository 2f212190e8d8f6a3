#version 330 core
// Lambert under a sun and a sky: the same formula as render/raycast_backend.py.
in vec3 frag_position;
in vec3 frag_normal;
out vec4 frag_color;

struct Material {
    vec4 base_color_factor;
#ifdef HAS_BASE_COLOR_TEX
    sampler2D base_color_texture;
#endif
};
#ifdef HAS_BASE_COLOR_TEX
in vec2 frag_uv;
#endif
uniform Material material;
uniform vec3 to_sun;
uniform float sun;
uniform float sky;
uniform float ground;
uniform int real;  // a thing of the film underneath: only what it loses of its light shows

#ifdef DIRECTIONAL_LIGHT_SHADOWS
uniform sampler2D shadow_map;
uniform mat4 light_matrix;
uniform float blur;  // radius of the soft edge, metres
const float LIFT = 0.004;  // metres off the surface, which would else shade itself
const int FEW = 5;
const int ALL = 16;
const vec2 TAPS[ALL] = vec2[](
    vec2(0.0), vec2(0.92, 0.38), vec2(-0.38, 0.92), vec2(-0.92, -0.38), vec2(0.38, -0.92),
    vec2(-0.26, 0.24), vec2(0.04, -0.46), vec2(0.33, 0.43), vec2(-0.61, -0.11),
    vec2(0.56, -0.37), vec2(-0.19, 0.72), vec2(-0.34, -0.71), vec2(0.78, 0.25),
    vec2(-0.83, 0.39), vec2(0.40, -0.85), vec2(0.31, 0.88));

float lit_at(vec3 s) {
    // Where there is no caster the map holds 1, which a point behind all casters must not exceed.
    return texture(shadow_map, s.xy).r < min(s.z, 1.0) ? 0.0 : 1.0;
}

// Share of a disc around this point that the sun sees. The disc lies in the surface, so that slopes
// do not shade themselves.
float sunlit(vec3 n) {
    vec3 t = normalize(cross(n, abs(n.x) < 0.7 ? vec3(1, 0, 0) : vec3(0, 1, 0)));
    vec3 s = (light_matrix * vec4(frag_position + LIFT * n, 1.0)).xyz * 0.5 + 0.5;
    mat2x3 disc = mat2x3(mat3(light_matrix) * t, mat3(light_matrix) * cross(n, t)) * (0.5 * blur);
    bool inside = all(greaterThanEqual(s.xy, vec2(0.0))) && all(lessThanEqual(s.xy, vec2(1.0)));
    // Such a loop is left when no pixel of a block needs it, where an "if" would run for all.
    float lit = 0.0;
    for (int once = 0; once < int(inside); once++)
        for (int i = 0; i < FEW; i++) lit += lit_at(s + disc * TAPS[i]);
    bool edge = inside && lit > 0.0 && lit < float(FEW);
    for (int once = 0; once < int(edge); once++)
        for (int i = FEW; i < ALL; i++) lit += lit_at(s + disc * TAPS[i]);
    return inside ? lit / float(edge ? ALL : FEW) : 1.0;
}
#endif

void main() {
    vec3 n = normalize(frag_normal);
    if (!gl_FrontFacing) n = -n;
    float facing = max(dot(n, to_sun), 0.0);
    float direct = sun * facing;
    float ambient = mix(ground, sky, 0.5 + 0.5 * n.z);
    float light = direct + ambient;
#ifdef DIRECTIONAL_LIGHT_SHADOWS
    if (facing > 0.0) light = direct * sunlit(n) + ambient;
#endif
    if (real != 0) {
        frag_color = vec4(0.0, 0.0, 0.0, 1.0 - light / (direct + ambient));
        return;
    }
    vec3 color = material.base_color_factor.rgb;
#ifdef HAS_BASE_COLOR_TEX
    color *= texture(material.base_color_texture, frag_uv).rgb;
#endif
    frag_color = vec4(color * light, 1.0);
}
