/* The open protocol of docs/wire.md in C99, without a heap: frames, requests and answers, and a socket to carry them. */

#ifndef WIRE_H
#define WIRE_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define WIRE_PROTOCOL 2u
/* Longest frame: 512 floats and what is around them. */
#define WIRE_FRAME 2176u

enum { WIRE_HELLO = 0, WIRE_RESET = 1, WIRE_OBSERVE = 2 };
enum { WIRE_IDENTITY = 0, WIRE_READY = 1, WIRE_INDEX = 2, WIRE_VALUES = 3, WIRE_REFUSED = 4 };

/* A message that is written or read from the front; `bad` where it was too short or too long. */
typedef struct {
    uint8_t bytes[WIRE_FRAME];
    size_t len, at;
    int bad;
} wire_message;

static inline void wire_put(wire_message *m, uint8_t byte)
{
    if (m->len < sizeof m->bytes) {
        m->bytes[m->len++] = byte;
    } else {
        m->bad = 1;
    }
}

/* A whole number in groups of seven bits, the lowest first; all but the last group have bit 7 set. */
static inline void wire_put_number(wire_message *m, uint64_t number)
{
    while (number > 0x7f) {
        wire_put(m, (uint8_t)((number & 0x7f) | 0x80));
        number >>= 7;
    }
    wire_put(m, (uint8_t)number);
}

static inline void wire_put_floats(wire_message *m, const float *values, size_t count)
{
    size_t k;
    wire_put_number(m, 4 * (uint64_t)count);
    for (k = 0; k < count; k++) {
        uint32_t bits;
        memcpy(&bits, &values[k], sizeof bits);
        wire_put(m, (uint8_t)bits);
        wire_put(m, (uint8_t)(bits >> 8));
        wire_put(m, (uint8_t)(bits >> 16));
        wire_put(m, (uint8_t)(bits >> 24));
    }
}

static inline uint8_t wire_take(wire_message *m)
{
    if (m->at < m->len) {
        return m->bytes[m->at++];
    }
    m->bad = 1;
    return 0;
}

static inline uint64_t wire_take_number(wire_message *m)
{
    uint64_t number = 0;
    unsigned shift;
    for (shift = 0; shift < 64; shift += 7) {
        uint8_t byte = wire_take(m);
        number |= (uint64_t)(byte & 0x7f) << shift;
        if (byte < 0x80) {
            return number;
        }
    }
    m->bad = 1;
    return 0;
}

/* Reads floats; returns how many there are, of which at most `most` are stored. */
static inline size_t wire_take_floats(wire_message *m, float *values, size_t most)
{
    size_t count = (size_t)wire_take_number(m) / 4, k;
    for (k = 0; k < count && !m->bad; k++) {
        uint32_t bits = wire_take(m);
        bits |= (uint32_t)wire_take(m) << 8;
        bits |= (uint32_t)wire_take(m) << 16;
        bits |= (uint32_t)wire_take(m) << 24;
        if (k < most) {
            memcpy(&values[k], &bits, sizeof bits);
        }
    }
    return count;
}

/* CRC-32 as in ZIP and Ethernet. */
static inline uint32_t wire_crc(const uint8_t *bytes, size_t len)
{
    uint32_t crc = 0xffffffffu;
    size_t k;
    int bit;
    for (k = 0; k < len; k++) {
        crc ^= bytes[k];
        for (bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ ((crc & 1u) ? 0xedb88320u : 0u);
        }
    }
    return ~crc;
}

/* Writes the frame of a message: zero, COBS(message, CRC-32), zero. Returns its length, 0 if it does not fit. */
static inline size_t wire_seal(wire_message *m, uint8_t *frame, size_t room)
{
    uint32_t crc = wire_crc(m->bytes, m->len);
    size_t k, out = 2, start = 1;
    for (k = 0; k < 4; k++) {
        wire_put(m, (uint8_t)(crc >> (8 * k)));
    }
    if (m->bad || m->len + m->len / 254 + 3 > room) {
        return 0;
    }
    frame[0] = 0;
    for (k = 0; k < m->len; k++) {
        if (m->bytes[k] != 0) {
            frame[out++] = m->bytes[k];
        }
        if (m->bytes[k] == 0 || out - start == 255) {
            frame[start] = (uint8_t)(out - start);
            start = out++;
        }
    }
    frame[start] = (uint8_t)(out - start);
    frame[out++] = 0;
    return out;
}

/* Reads what lies between two zeros; whether it is undamaged. */
static inline int wire_unseal(const uint8_t *coded, size_t len, wire_message *m)
{
    size_t at = 0;
    uint32_t crc = 0;
    memset(m, 0, sizeof *m);
    while (at < len) {
        size_t block = coded[at], k;
        if (block == 0 || at + block > len) {
            return 0;
        }
        for (k = 1; k < block; k++) {
            wire_put(m, coded[at + k]);
        }
        at += block;
        if (block < 255 && at < len) {
            wire_put(m, 0);
        }
    }
    if (m->bad || m->len < 4) {
        return 0;
    }
    m->len -= 4;
    for (at = 0; at < 4; at++) {
        crc |= (uint32_t)m->bytes[m->len + at] << (8 * at);
    }
    return crc == wire_crc(m->bytes, m->len);
}

/* The way to a peer. */
typedef struct {
    int socket, is_stream;
    /* Of the peer, once it has spoken, where it spoke first. */
    struct sockaddr_storage peer;
    socklen_t peer_len;
    uint8_t unread[WIRE_FRAME];
    size_t unread_len, unread_at;
    uint8_t coded[WIRE_FRAME];
    size_t coded_len;
} wire_channel;

static inline int wire_fail(const char *what)
{
    perror(what);
    exit(1);
}

/* Opens `unix:PATH` or `udp:HOST:PORT`, to a peer or, with `listen_here`, from one. Ends the program where it cannot. */
static inline void wire_open(wire_channel *c, const char *place, int listen_here)
{
    memset(c, 0, sizeof *c);
    if (strncmp(place, "unix:", 5) == 0 && strlen(place + 5) < sizeof ((struct sockaddr_un *)0)->sun_path) {
        struct sockaddr_un address;
        memset(&address, 0, sizeof address);
        address.sun_family = AF_UNIX;
        memcpy(address.sun_path, place + 5, strlen(place + 5));
        c->is_stream = 1;
        c->socket = socket(AF_UNIX, SOCK_STREAM, 0);
        if (listen_here) {
            int listener = c->socket;
            if (bind(listener, (struct sockaddr *)&address, sizeof address) != 0 || listen(listener, 1) != 0
                || (c->socket = accept(listener, NULL, NULL)) < 0) {
                wire_fail(place);
            }
            close(listener);
        } else if (connect(c->socket, (struct sockaddr *)&address, sizeof address) != 0) {
            wire_fail(place);
        }
    } else if (strncmp(place, "udp:", 4) == 0 && strrchr(place + 4, ':') != NULL) {
        struct addrinfo hints, *found = NULL;
        char host[256];
        const char *port = strrchr(place + 4, ':') + 1;
        size_t host_len = (size_t)(port - 1 - (place + 4));
        memset(&hints, 0, sizeof hints);
        hints.ai_family = AF_INET;
        hints.ai_socktype = SOCK_DGRAM;
        if (host_len >= sizeof host) {
            wire_fail(place);
        }
        memcpy(host, place + 4, host_len);
        host[host_len] = 0;
        if (getaddrinfo(host, port, &hints, &found) != 0) {
            wire_fail(place);
        }
        c->socket = socket(AF_INET, SOCK_DGRAM, 0);
        if ((listen_here ? bind(c->socket, found->ai_addr, found->ai_addrlen)
                         : connect(c->socket, found->ai_addr, found->ai_addrlen)) != 0) {
            wire_fail(place);
        }
        freeaddrinfo(found);
    } else {
        fprintf(stderr, "%s: use unix:PATH or udp:HOST:PORT\n", place);
        exit(2);
    }
}

/* Sends a message. What does not get out is lost, as on any line. */
static inline void wire_send(wire_channel *c, wire_message *m)
{
    uint8_t frame[WIRE_FRAME];
    size_t len = wire_seal(m, frame, sizeof frame);
    const struct sockaddr *peer = c->peer_len != 0 ? (const struct sockaddr *)&c->peer : NULL;
    if (sendto(c->socket, frame, len, MSG_NOSIGNAL, peer, c->peer_len) < 0) {
        return;
    }
}

/* Waits for a good message, at most so many milliseconds, or for ever if negative. Whether one came; 0 too when the
   peer has left, which sets `socket` to -1. */
static inline int wire_receive(wire_channel *c, wire_message *m, int timeout_ms)
{
    for (;;) {
        struct pollfd ready;
        ssize_t len;
        while (c->unread_at < c->unread_len) {
            uint8_t byte = c->unread[c->unread_at++];
            if (byte != 0) {
                if (c->coded_len < sizeof c->coded) {
                    c->coded[c->coded_len] = byte;
                }
                c->coded_len++;
            } else {
                size_t coded_len = c->coded_len;
                c->coded_len = 0;
                if (coded_len != 0 && coded_len <= sizeof c->coded && wire_unseal(c->coded, coded_len, m)) {
                    return 1;
                }
            }
        }
        ready.fd = c->socket;
        ready.events = POLLIN;
        if (poll(&ready, 1, timeout_ms) <= 0) {
            return 0;
        }
        c->peer_len = c->is_stream ? 0 : sizeof c->peer;
        len = recvfrom(c->socket, c->unread, sizeof c->unread, 0,
                       c->is_stream ? NULL : (struct sockaddr *)&c->peer, c->is_stream ? NULL : &c->peer_len);
        if (len < 0 || (len == 0 && c->is_stream)) {
            if (c->is_stream) {
                c->socket = -1;
                return 0;
            }
            len = 0;
        }
        c->unread_at = 0;
        c->unread_len = (size_t)len;
    }
}

#endif
