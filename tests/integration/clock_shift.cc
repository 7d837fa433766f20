// Preloaded into a program, shifts its wall clock by the seconds in the file CLOCK_SHIFT_FILE, read anew at every call:
// a machine whose clock is wrong, or jumps.
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include <sys/syscall.h>
#include <unistd.h>

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const long done = syscall(SYS_clock_gettime, clock, time);
  if (done != 0 || clock != CLOCK_REALTIME) return static_cast<int>(done);
  const char* name = std::getenv("CLOCK_SHIFT_FILE");
  std::FILE* file = name != nullptr ? std::fopen(name, "r") : nullptr;
  if (file == nullptr) return 0;
  long shift_s = 0;
  if (std::fscanf(file, "%ld", &shift_s) == 1) time->tv_sec += shift_s;
  std::fclose(file);
  return 0;
}
