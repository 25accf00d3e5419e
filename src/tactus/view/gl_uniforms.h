#pragma once
/// Values of a program's uniforms. Internal to view/.
#include "tactus/view/gl_objects.h"
#include "tactus/view/projection.h"

namespace tactus {

inline void set(const GlProgram& program, const char* name, float value) {
  glProgramUniform1f(program.get(), program[name], value);
}
inline void set(const GlProgram& program, const char* name, bool value) {
  glProgramUniform1i(program.get(), program[name], value ? 1 : 0);
}
inline void set(const GlProgram& program, const char* name, Vec3f value) {
  glProgramUniform3f(program.get(), program[name], value.x, value.y, value.z);
}
inline void set(const GlProgram& program, const char* name, const Mat4& value) {
  glProgramUniformMatrix4fv(program.get(), program[name], 1, GL_FALSE, value.m.data());
}
inline void set(const GlProgram& program, const char* name, int x, int y) {
  glProgramUniform2i(program.get(), program[name], x, y);
}
inline void set(const GlProgram& program, const char* name, float x, float y) {
  glProgramUniform2f(program.get(), program[name], x, y);
}

}  // namespace tactus
