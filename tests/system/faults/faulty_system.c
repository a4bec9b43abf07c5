// Injects a fault below the program by LD_PRELOAD: VERGENCE_STALL='AT SECONDS' makes every write to
// a file that begins in that time since the start last to its end.
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

static double started;

static double now(void) {
  struct timespec t;
  (void)syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

__attribute__((constructor)) static void start(void) { started = now(); }

static int asked(const char* name, double* at, double* seconds) {
  const char* text = getenv(name);
  return text != NULL && sscanf(text, "%lf %lf", at, seconds) == 2;
}

// Once: that what was asked for has come about. The caller's tests look for it.
static void say(const char* line, size_t size) {
  static int said;
  if (__atomic_exchange_n(&said, 1, __ATOMIC_RELAXED) == 0) (void)syscall(SYS_write, 2, line, size);
}

static void stall(int fd) {
  double at = 0;
  double seconds = 0;
  struct stat about;
  if (!asked("VERGENCE_STALL", &at, &seconds) || fstat(fd, &about) != 0 || !S_ISREG(about.st_mode))
    return;
  const double since = now() - started;
  if (since < at || since > at + seconds) return;
  static const char line[] = "faulty_system: a write waits\n";
  say(line, sizeof line - 1);
  const double rest = at + seconds - since;
  const struct timespec pause = {(time_t)rest, (long)(1e9 * (rest - (double)(time_t)rest))};
  (void)nanosleep(&pause, NULL);
}

ssize_t write(int fd, const void* data, size_t size) {
  stall(fd);
  return syscall(SYS_write, fd, data, size);
}

ssize_t writev(int fd, const struct iovec* parts, int count) {
  stall(fd);
  return syscall(SYS_writev, fd, parts, count);
}

int fdatasync(int fd) {
  stall(fd);
  return (int)syscall(SYS_fdatasync, fd);
}

int fsync(int fd) {
  stall(fd);
  return (int)syscall(SYS_fsync, fd);
}
