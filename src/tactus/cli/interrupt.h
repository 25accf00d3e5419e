#pragma once
/// Ctrl-C, SIGTERM and a terminal that is lost (SIGHUP, unless it is ignored). The first signal asks: long
/// loops poll, finish the frame and their files, and the program exits with 130. The second ends the program
/// at once; its temporary files go, finished files stay.
namespace tactus {
void install_interrupt_handler();
bool interrupted();
}  // namespace tactus
