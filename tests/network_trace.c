/* Loaded by LD_PRELOAD: refuses whatever a process would send off this machine, and appends a line about it to the file
   that E2EFLY_NETWORK_TRACE names. It sees connects, datagrams and look-ups of names made through the C library. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static void tell(const char *what, const char *where, int port) {
  const char *path = getenv("E2EFLY_NETWORK_TRACE");
  char line[512];
  int length = snprintf(line, sizeof line, "%s %s %d by %s\n", what, where, port, program_invocation_short_name);
  int file = path ? open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600) : -1;
  if (file >= 0) {
    if (write(file, line, (size_t)length) < 0) abort();
    close(file);
  }
}

/* Whether an address is on another machine; if so, a line is written. */
static int away(const char *what, const struct sockaddr *address) {
  char text[INET6_ADDRSTRLEN] = "";
  if (address == NULL) return 0;
  if (address->sa_family == AF_INET) {
    const struct sockaddr_in *in = (const struct sockaddr_in *)address;
    unsigned first = ntohl(in->sin_addr.s_addr) >> 24;
    if (first == 127 || first == 0) return 0;
    inet_ntop(AF_INET, &in->sin_addr, text, sizeof text);
    tell(what, text, ntohs(in->sin_port));
    return 1;
  }
  if (address->sa_family == AF_INET6) {
    const struct sockaddr_in6 *in = (const struct sockaddr_in6 *)address;
    const unsigned char *bytes = in->sin6_addr.s6_addr;
    int mapped = IN6_IS_ADDR_V4MAPPED(&in->sin6_addr);
    if (IN6_IS_ADDR_LOOPBACK(&in->sin6_addr) || IN6_IS_ADDR_UNSPECIFIED(&in->sin6_addr)) return 0;
    if (mapped && bytes[12] == 127) return 0;
    inet_ntop(AF_INET6, &in->sin6_addr, text, sizeof text);
    tell(what, text, ntohs(in->sin6_port));
    return 1;
  }
  return 0;
}

static int refused(void) {
  errno = ENETUNREACH;
  return -1;
}

int connect(int socket, const struct sockaddr *address, socklen_t length) {
  int (*real)(int, const struct sockaddr *, socklen_t) = dlsym(RTLD_NEXT, "connect");
  return away("connect", address) ? refused() : real(socket, address, length);
}

ssize_t sendto(int socket, const void *data, size_t size, int flags, const struct sockaddr *to, socklen_t length) {
  ssize_t (*real)(int, const void *, size_t, int, const struct sockaddr *, socklen_t) = dlsym(RTLD_NEXT, "sendto");
  return away("send", to) ? refused() : real(socket, data, size, flags, to, length);
}

ssize_t sendmsg(int socket, const struct msghdr *message, int flags) {
  ssize_t (*real)(int, const struct msghdr *, int) = dlsym(RTLD_NEXT, "sendmsg");
  return away("send", message->msg_name) ? refused() : real(socket, message, flags);
}

int getaddrinfo(const char *name, const char *service, const struct addrinfo *hints, struct addrinfo **found) {
  int (*real)(const char *, const char *, const struct addrinfo *, struct addrinfo **) = dlsym(RTLD_NEXT, "getaddrinfo");
  unsigned char binary[sizeof(struct in6_addr)];
  char own[256] = "";
  gethostname(own, sizeof own - 1);
  if (name == NULL || *name == 0 || !strcmp(name, "localhost") || !strcmp(name, own) || strchr(name, '%') ||
      inet_pton(AF_INET, name, binary) == 1 || inet_pton(AF_INET6, name, binary) == 1)
    return real(name, service, hints, found);
  tell("lookup", name, 0);
  return EAI_NONAME;
}
