#version 330 core
// The names in capitals are replaced by pyrender before compiling.
layout(location = 0) in vec3 position;
layout(location = NORMAL_LOC) in vec3 normal;
#ifdef TEXCOORD_0_LOC
layout(location = TEXCOORD_0_LOC) in vec2 uv;
out vec2 frag_uv;
#endif

uniform mat4 M;
uniform mat4 view_projection;
uniform mat4 sun_view;  // into the axes of the sun: z points towards it

out vec3 frag_normal;  // in the axes of the sun
#ifdef DIRECTIONAL_LIGHT_SHADOWS
uniform mat4 light_matrix;
out vec3 frag_light;  // place and depth in the shadow map, 0 to 1
#endif

void main() {
    vec4 world = M * vec4(position, 1.0);
    gl_Position = view_projection * world;
#ifdef DIRECTIONAL_LIGHT_SHADOWS
    frag_light = (light_matrix * world).xyz * 0.5 + 0.5;
#endif
    frag_normal = mat3(sun_view) * (mat3(M) * normal);
#ifdef TEXCOORD_0_LOC
    frag_uv = uv;
#endif
}
