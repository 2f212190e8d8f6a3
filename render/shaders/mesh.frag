#version 330 core
#extension GL_ARB_derivative_control : enable
// Lambert under a sun and a sky: the same formula as render/raycast_backend.py.
in vec3 frag_normal;  // in the axes of the sun: z points towards it
out vec4 frag_color;

uniform vec3 base_color;
#ifdef HAS_BASE_COLOR_TEX
uniform sampler2D base_color_texture;
in vec2 frag_uv;
#endif
uniform vec3 up;  // of the world, in the axes of the sun
uniform float sun;
uniform float sky;
uniform float ground;
uniform int real;  // a thing of the film underneath: only what it loses of its light shows

#ifdef DIRECTIONAL_LIGHT_SHADOWS
in vec3 frag_light;
uniform sampler2D shadow_map;
uniform vec3 light_scale;  // how much frag_light changes in a metre along each axis of the sun
uniform float blur;  // radius of the soft edge, metres
const float LIFT = 0.004;  // metres off the surface, which would else shade itself
const vec2 TAPS[16] = vec2[](
    vec2(0.92, 0.38), vec2(-0.38, 0.92), vec2(-0.92, -0.38), vec2(0.38, -0.92),
    vec2(-0.26, 0.24), vec2(0.04, -0.46), vec2(0.33, 0.43), vec2(-0.61, -0.11),
    vec2(0.56, -0.37), vec2(-0.19, 0.72), vec2(-0.34, -0.71), vec2(0.78, 0.25),
    vec2(-0.83, 0.39), vec2(0.40, -0.85), vec2(0.31, 0.88), vec2(0.0));

float lit_at(vec3 s) {
    // Where there is no caster the map holds 1, which a point behind all casters must not exceed.
    return texture(shadow_map, s.xy).r < min(s.z, 1.0) ? 0.0 : 1.0;
}

// The graphics card draws blocks of two by two pixels. The pixels of a block share the four taps of a row:
// each samples the shadow map at one of them, and derivatives tell it what the others found. Where the card
// has no exact derivatives, each pixel samples all four.
// "#if defined", because pyrender itself replaces every "#ifdef", and knows nothing of extensions.
#if defined(GL_ARB_derivative_control)
float lit_in_row(int row, vec3 s, mat2x3 disc) {
    ivec2 odd = ivec2(gl_FragCoord.xy) & 1;
    return lit_at(s + disc * TAPS[4 * row + 2 * odd.y + odd.x]);
}

float mean_of_four(float value) {
    vec2 other = 0.5 - vec2(ivec2(gl_FragCoord.xy) & 1);
    value += other.x * dFdxFine(value);
    return value + other.y * dFdyFine(value);
}
#else
float lit_in_row(int row, vec3 s, mat2x3 disc) {
    float lit = 0.0;
    for (int i = 0; i < 4; i++) lit += lit_at(s + disc * TAPS[4 * row + i]);
    return lit / 4.0;
}

float mean_of_four(float value) { return value; }
#endif

// Share of a disc around this point that the sun sees. The disc lies in the surface, so that slopes
// do not shade themselves; seen from the sun it is a circle.
float sunlit(vec3 n) {
    bool inside = n.z > 0.0 && all(lessThanEqual(abs(frag_light.xy - 0.5), vec2(0.5)));
    vec3 s = frag_light + light_scale * n * LIFT;
    vec2 across = light_scale.xy * (blur * n.z);
    vec2 deep = n.xy * (-light_scale.z * blur);
    mat2x3 disc = mat2x3(across.x, 0.0, deep.x, 0.0, across.y, deep.y);
    float lit = 1.0;
    // Such a loop is left when no pixel of a block needs it, where an "if" would run for all.
    for (int once = 0; once < int(inside); once++)
        lit = 0.5 * (lit_in_row(0, s, disc) + lit_in_row(1, s, disc));
    lit = mean_of_four(lit);
    bool edge = lit > 0.01 && lit < 0.99;
    float more = 1.0;
    for (int once = 0; once < int(edge && inside); once++)
        more = 0.5 * (lit_in_row(2, s, disc) + lit_in_row(3, s, disc));
    more = mean_of_four(more);
    return edge ? 0.5 * (lit + more) : lit;
}
#endif

void main() {
    vec3 n = normalize(frag_normal);
    if (!gl_FrontFacing) n = -n;
    float direct = sun * max(n.z, 0.0);
    float ambient = mix(ground, sky, 0.5 + 0.5 * dot(n, up));
    float light = direct + ambient;
#ifdef DIRECTIONAL_LIGHT_SHADOWS
    light = direct * sunlit(n) + ambient;
#endif
    if (real != 0) {
        frag_color = vec4(0.0, 0.0, 0.0, 1.0 - light / (direct + ambient));
        return;
    }
    vec3 color = base_color;
#ifdef HAS_BASE_COLOR_TEX
    color *= texture(base_color_texture, frag_uv).rgb;
#endif
    frag_color = vec4(color * light, 1.0);
}
