#pragma once
/// Ctrl-C: long loops poll, finish their files and end; the program then exits with 130.
namespace tactus {
void install_interrupt_handler();
bool interrupted();
}  // namespace tactus
