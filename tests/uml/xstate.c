/*
 * Lets User Mode Linux run on processors whose register state is larger than it knows (AMX).
 *
 * Linux 6.1's UML keeps room for the registers up to PKRU. Since Linux 5.16 a host wants the whole
 * state when it is set by PTRACE_SETREGSET (NT_X86_XSTATE), and answers EFAULT to less: the guest's
 * first process then dies in put_fp_registers. Preloaded, this function fills up the rest with what
 * the process has; nothing that UML saved is changed.
 *
 * Source: ptrace(2); xstateregs_set in arch/x86/kernel/fpu/regset.c; Intel SDM 1, 13.4.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

/* Larger than the state of any processor: Intel's largest is some 11 KiB. */
static char whole[65536];

typedef long ptrace_function(int request, pid_t process, void *address, void *data);

long ptrace(enum __ptrace_request request, ...)
{
    static ptrace_function *next;
    va_list arguments;
    va_start(arguments, request);
    pid_t process = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);
    if (!next)
        next = (ptrace_function *)dlsym(RTLD_NEXT, "ptrace");

    long result = next(request, process, address, data);
    if (request != PTRACE_SETREGSET || address != (void *)NT_X86_XSTATE || result == 0)
        return result;

    int refused = errno;
    const struct iovec *known = data;
    struct iovec all = {.iov_base = whole, .iov_len = sizeof whole};
    if (next(PTRACE_GETREGSET, process, address, &all) != 0 || all.iov_len <= known->iov_len) {
        errno = refused;
        return result;
    }
    memcpy(whole, known->iov_base, known->iov_len);
    return next(PTRACE_SETREGSET, process, address, &all);
}
