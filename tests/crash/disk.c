/* Counts the calls of a program that change files below one folder, and lets one of them fail. Preloaded by tests/crash/disk.rs.
 *
 * SKINRIG_DISK_UNDER   the folder, an absolute path without links
 * SKINRIG_DISK_LOG     a file outside of it, to which each such call adds a line
 * SKINRIG_DISK_FAULT   KIND:N, what happens at call N, counted from 1:
 *   kill     the process ends before the call
 *   torn     the first half of a write is done, any other call whole; then the process ends
 *   eio      the call does nothing and fails with EIO
 *   enospc   the call does nothing and fails with ENOSPC
 *   full     so does every later call that needs room
 *   short    a write does its first half and says so
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long calls;

enum fault { NONE, KILL, TORN, EIO_ONCE, ENOSPC_ONCE, SHORT };

static int below(const char *path) {
    const char *under = getenv("SKINRIG_DISK_UNDER");
    size_t n = under ? strlen(under) : 0;
    return n > 0 && strncmp(path, under, n) == 0 && (path[n] == '/' || path[n] == 0);
}

static int path_of(int fd, char *path) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, PATH_MAX - 1);
    if (n < 0) return 0;
    path[n] = 0;
    return 1;
}

static const char *absolute(const char *path, char *space) {
    if (path[0] == '/') return path;
    char folder[PATH_MAX];
    if (!getcwd(folder, sizeof folder)) return path;
    snprintf(space, 2 * PATH_MAX, "%s/%s", folder, path);
    return space;
}

/* Counts the call when it is below the folder, and says what is to become of it. */
static enum fault next(const char *path, const char *what, int needs_room) {
    int saved = errno;
    if (!below(path)) return NONE;
    long n = atomic_fetch_add(&calls, 1) + 1;
    const char *log = getenv("SKINRIG_DISK_LOG");
    if (log) {
        char line[PATH_MAX + 64];
        int length = snprintf(line, sizeof line, "%ld %s %s\n", n, what, path);
        long fd = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_APPEND | O_CREAT, 0600);
        if (fd >= 0) {
            syscall(SYS_write, fd, line, length);
            syscall(SYS_close, fd);
        }
    }
    errno = saved;
    const char *fault = getenv("SKINRIG_DISK_FAULT");
    if (!fault) return NONE;
    const char *colon = strchr(fault, ':');
    long at = colon ? atol(colon + 1) : 0;
    if (strncmp(fault, "full:", 5) == 0) return n >= at && needs_room ? ENOSPC_ONCE : NONE;
    if (n != at) return NONE;
    if (strncmp(fault, "kill:", 5) == 0) return KILL;
    if (strncmp(fault, "torn:", 5) == 0) return TORN;
    if (strncmp(fault, "eio:", 4) == 0) return EIO_ONCE;
    if (strncmp(fault, "enospc:", 7) == 0) return ENOSPC_ONCE;
    if (strncmp(fault, "short:", 6) == 0) return SHORT;
    return NONE;
}

static void gone(void) {
    syscall(SYS_kill, (long)getpid(), SIGKILL);
    for (;;) pause();
}

/* What comes before any call but a write: 1 when it is to fail. */
static int fails(enum fault fault) {
    if (fault == KILL) gone();
    if (fault == EIO_ONCE) { errno = EIO; return 1; }
    if (fault == ENOSPC_ONCE) { errno = ENOSPC; return 1; }
    return 0;
}

#define REAL(type, name, ...) \
    static type (*real)(__VA_ARGS__); \
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, name)

#define WHOLE(fault, call) \
    do { \
        if (fails(fault)) return -1; \
        int result = call; \
        if (fault == TORN) gone(); \
        return result; \
    } while (0)

#define WRITTEN(name, fd, length, half, whole) \
    do { \
        char path[PATH_MAX]; \
        enum fault fault = path_of(fd, path) ? next(path, name, 1) : NONE; \
        if (fails(fault)) return -1; \
        if ((fault == TORN || fault == SHORT) && length > 1) { \
            ssize_t result = half; \
            if (fault == TORN) gone(); \
            return result; \
        } \
        ssize_t result = whole; \
        if (fault == TORN) gone(); \
        return result; \
    } while (0)

ssize_t write(int fd, const void *bytes, size_t length) {
    REAL(ssize_t, "write", int, const void *, size_t);
    WRITTEN("write", fd, length, real(fd, bytes, length / 2), real(fd, bytes, length));
}

ssize_t pwrite(int fd, const void *bytes, size_t length, off_t at) {
    REAL(ssize_t, "pwrite", int, const void *, size_t, off_t);
    WRITTEN("pwrite", fd, length, real(fd, bytes, length / 2, at), real(fd, bytes, length, at));
}

ssize_t pwrite64(int fd, const void *bytes, size_t length, off64_t at) {
    REAL(ssize_t, "pwrite64", int, const void *, size_t, off64_t);
    WRITTEN("pwrite64", fd, length, real(fd, bytes, length / 2, at), real(fd, bytes, length, at));
}

#define BY_FD(name, parameters, arguments, room) \
    int name parameters { \
        static int (*real) parameters; \
        if (!real) *(void **)&real = dlsym(RTLD_NEXT, #name); \
        char path[PATH_MAX]; \
        enum fault fault = path_of(fd, path) ? next(path, #name, room) : NONE; \
        WHOLE(fault, real arguments); \
    }

BY_FD(fsync, (int fd), (fd), 0)
BY_FD(fdatasync, (int fd), (fd), 0)
BY_FD(ftruncate, (int fd, off_t length), (fd, length), 1)
BY_FD(ftruncate64, (int fd, off64_t length), (fd, length), 1)
BY_FD(fallocate, (int fd, int mode, off_t at, off_t length), (fd, mode, at, length), 1)
BY_FD(posix_fallocate, (int fd, off_t at, off_t length), (fd, at, length), 1)
BY_FD(fchmod, (int fd, mode_t mode), (fd, mode), 0)

#define BY_PATH(name, parameters, arguments, room) \
    int name parameters { \
        static int (*real) parameters; \
        if (!real) *(void **)&real = dlsym(RTLD_NEXT, #name); \
        char space[2 * PATH_MAX]; \
        enum fault fault = next(absolute(path, space), #name, room); \
        WHOLE(fault, real arguments); \
    }

BY_PATH(unlink, (const char *path), (path), 0)
BY_PATH(rename, (const char *path, const char *to), (path, to), 0)
BY_PATH(mkdir, (const char *path, mode_t mode), (path, mode), 1)
BY_PATH(chmod, (const char *path, mode_t mode), (path, mode), 0)

#define OPENED(name) \
    int name(const char *path, int flags, ...) { \
        REAL(int, #name, const char *, int, ...); \
        mode_t mode = 0; \
        if (flags & (O_CREAT | __O_TMPFILE)) { \
            va_list list; \
            va_start(list, flags); \
            mode = va_arg(list, mode_t); \
            va_end(list); \
        } \
        char space[2 * PATH_MAX]; \
        enum fault fault = flags & (O_CREAT | O_TRUNC) ? next(absolute(path, space), #name, 1) : NONE; \
        WHOLE(fault, real(path, flags, mode)); \
    }

OPENED(open)
OPENED(open64)
