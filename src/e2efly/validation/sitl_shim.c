/* Loaded into the Betaflight SITL process by LD_PRELOAD; the firmware itself stays as it is.
 *
 * E2EFLY_SITL_BASE=PORT  moves the firmware's fixed ports (UDP 9001 to 9004, TCP 5761 to 5768) to free ones, on the
 *                        loopback interface only, so that many run side by side and none is seen from outside.
 * E2EFLY_SITL_CLOCK=FILE makes time virtual: the firmware's clock stops at a horizon that the simulator moves on, so
 *                        that a flight does not depend on how fast or busy the machine is.
 * E2EFLY_SITL_GO=FD      where the simulator writes a byte when it has moved the horizon.
 * E2EFLY_SITL_POKE=FD    where it writes a byte to have the network thread come round.
 * E2EFLY_SITL_DONE=FD    where a byte is written when the horizon is reached, when a vehicle state or a receiver's frame
 *                        was taken in, and when the network thread has come round.
 *
 * Each waits for the other in read(2): one flight keeps one core busy, and an idle one none.
 *
 * The firmware's main thread writes into the buffers that its network thread sends from, without a lock: now and then
 * bytes were lost or came twice. With virtual time, these two threads therefore take turns: the main thread has its
 * turn until the horizon, the network thread from the return of its select(2) until the next one.
 */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum { CALL_NS = 200, SELECT_US = 1000, STATE_BYTES = 144, FRAME_BYTES = 40 };

/* Shared with the simulator; all in ns or counts. */
struct shared {
    _Atomic uint64_t horizon; /* set by the simulator: the firmware runs up to here */
    _Atomic uint64_t now;     /* the firmware's time */
    _Atomic uint64_t waiting; /* the time beyond the horizon that its main thread waits for; 0 while it runs */
    _Atomic uint64_t states;  /* vehicle states that the firmware has taken in */
    _Atomic uint64_t frames;  /* frames of the pilot's receiver that it has taken in */
    _Atomic uint64_t rounds;  /* of its network thread since it was poked: it has read what was sent before */
};

static struct shared *shared;
static int base, go, poke, done;
static _Atomic int listening;
static _Thread_local int network, poked, on_turn;
static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER; /* of the main thread or of the network thread */
static _Thread_local _Atomic uint64_t *taken; /* what this thread has received counts here once it has dealt with it */

static ssize_t (*next_sendto)(int, const void *, size_t, int, const struct sockaddr *, socklen_t);
static ssize_t (*next_recvfrom)(int, void *, size_t, int, struct sockaddr *, socklen_t *);
static int (*next_bind)(int, const struct sockaddr *, socklen_t);
static int (*next_listen)(int, int);
static int (*next_select)(int, fd_set *, fd_set *, fd_set *, struct timeval *);
static int (*next_join)(pthread_t, void **);

__attribute__((constructor)) static void start(void)
{
    const char *port = getenv("E2EFLY_SITL_BASE"), *clock = getenv("E2EFLY_SITL_CLOCK");
    next_sendto = dlsym(RTLD_NEXT, "sendto");
    next_recvfrom = dlsym(RTLD_NEXT, "recvfrom");
    next_bind = dlsym(RTLD_NEXT, "bind");
    next_listen = dlsym(RTLD_NEXT, "listen");
    next_select = dlsym(RTLD_NEXT, "select");
    next_join = dlsym(RTLD_NEXT, "pthread_join");
    base = port ? atoi(port) : 0;
    prctl(PR_SET_TIMERSLACK, 1);         /* or its short sleeps last 50 us more */
    prctl(PR_SET_PDEATHSIG, SIGKILL);    /* nobody flies it any more */
    if (clock) {
        int fd = open(clock, O_RDWR | O_CLOEXEC);
        void *map = fd < 0 ? MAP_FAILED : mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        if (map == MAP_FAILED) _exit(97);
        shared = map;
        close(fd);
        go = atoi(getenv("E2EFLY_SITL_GO"));
        poke = atoi(getenv("E2EFLY_SITL_POKE"));
        done = atoi(getenv("E2EFLY_SITL_DONE"));
    }
}

/* Tell the simulator; it is gone if that fails. */
static void tell(void)
{
    while (write(done, "", 1) < 0)
        if (errno != EINTR) _exit(98);
}

static void take_turn(void)
{
    if (!on_turn) pthread_mutex_lock(&turn);
    on_turn = 1;
}

static void end_turn(void)
{
    if (on_turn) pthread_mutex_unlock(&turn);
    on_turn = 0;
}

static int moved(int port)
{
    if (base && port >= 9001 && port <= 9004) return base + port - 9001;
    if (base && port >= 5761 && port <= 5768) return base + 4 + port - 5761;
    return port;
}

int bind(int fd, const struct sockaddr *address, socklen_t size)
{
    if (address->sa_family == AF_INET) {
        struct sockaddr_in mine = *(const struct sockaddr_in *)address;
        mine.sin_port = htons(moved(ntohs(mine.sin_port)));
        mine.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        return next_bind(fd, (struct sockaddr *)&mine, sizeof mine);
    }
    if (address->sa_family == AF_INET6) { /* ::ffff:127.0.0.1 */
        struct sockaddr_in6 mine = *(const struct sockaddr_in6 *)address;
        const uint32_t loopback[4] = {0, 0, htonl(0xffff), htonl(INADDR_LOOPBACK)};
        mine.sin6_port = htons(moved(ntohs(mine.sin6_port)));
        memcpy(&mine.sin6_addr, loopback, sizeof loopback);
        return next_bind(fd, (struct sockaddr *)&mine, sizeof mine);
    }
    return next_bind(fd, address, size);
}

ssize_t sendto(int fd, const void *data, size_t size, int flags, const struct sockaddr *address, socklen_t length)
{
    if (address && address->sa_family == AF_INET) {
        struct sockaddr_in mine = *(const struct sockaddr_in *)address;
        mine.sin_port = htons(moved(ntohs(mine.sin_port)));
        return next_sendto(fd, data, size, flags, (struct sockaddr *)&mine, sizeof mine);
    }
    return next_sendto(fd, data, size, flags, address, length);
}

ssize_t recvfrom(int fd, void *data, size_t size, int flags, struct sockaddr *address, socklen_t *length)
{
    ssize_t got = next_recvfrom(fd, data, size, flags, address, length);
    if (shared && got == STATE_BYTES) taken = &shared->states;
    if (shared && got == FRAME_BYTES) taken = &shared->frames;
    return got;
}

int listen(int fd, int backlog)
{
    int result = next_listen(fd, backlog);
    atomic_store(&listening, 1);
    return result;
}

/* A thread that asks for more has dealt with what it got. The network thread waits for the simulator's poke, too. */
int select(int count, fd_set *readable, fd_set *writable, fd_set *odd, struct timeval *timeout)
{
    struct timeval brief = {0, SELECT_US};
    if (network) end_turn();
    if (taken) {
        atomic_fetch_add(taken, 1);
        taken = NULL;
        tell();
    }
    if (writable) network = 1; /* it alone asks where it may write; a slow one comes here first when a port is open */
    if (poked) {
        poked = 0;
        atomic_fetch_add(&shared->rounds, 1);
        tell();
    }
    if (count <= 1) { /* the network thread, before any port is open: it throws away one that is just being opened */
        const struct timespec pause = {0, 5000000};
        while (!atomic_load(&listening)) syscall(SYS_nanosleep, &pause, NULL);
        syscall(SYS_nanosleep, &pause, NULL);
    }
    if (!shared || !network || !readable || count <= 1) return next_select(count, readable, writable, odd, timeout);
    if (timeout && (timeout->tv_sec || timeout->tv_usec > SELECT_US)) timeout = &brief;
    FD_SET(poke, readable);
    int ready = next_select(count > poke ? count : poke + 1, readable, writable, odd, timeout);
    if (ready > 0 && FD_ISSET(poke, readable)) {
        char byte;
        FD_CLR(poke, readable);
        ready--;
        poked = read(poke, &byte, 1) == 1;
    }
    take_turn();
    return ready;
}

/* The firmware waits for its network thread before it ends, for example at `save`. */
int pthread_join(pthread_t thread, void **value)
{
    end_turn();
    return next_join(thread, value);
}

static int main_thread(void)
{
    static _Thread_local enum { UNKNOWN, YES, NO } answer; /* asked some 600 times a step of 2 ms */
    if (answer == UNKNOWN) answer = syscall(SYS_gettid) == getpid() ? YES : NO;
    return answer == YES;
}

/* Only the main thread moves time on: a little with each look at the clock, as looking costs time on a real one too. */
static uint64_t advance(uint64_t by)
{
    char byte;
    uint64_t now = atomic_load(&shared->now) + by;
    while (now > atomic_load(&shared->horizon)) {
        atomic_store(&shared->waiting, now);
        end_turn();
        tell();
        while (read(go, &byte, 1) < 0)
            if (errno != EINTR) _exit(98);
    }
    take_turn();
    atomic_store(&shared->waiting, 0);
    atomic_store(&shared->now, now);
    return now;
}

int clock_gettime(clockid_t id, struct timespec *out)
{
    if (!shared || id != CLOCK_MONOTONIC) return syscall(SYS_clock_gettime, id, out);
    uint64_t now = main_thread() ? advance(CALL_NS) : atomic_load(&shared->now);
    out->tv_sec = 1000 + now / 1000000000u;
    out->tv_nsec = now % 1000000000u;
    return 0;
}

int nanosleep(const struct timespec *wanted, struct timespec *left)
{
    if (shared && main_thread()) {
        advance(wanted->tv_sec * 1000000000u + wanted->tv_nsec);
        return 0;
    }
    return syscall(SYS_nanosleep, wanted, left);
}
