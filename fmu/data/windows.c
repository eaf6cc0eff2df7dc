/* What a library for Windows needs beyond the C runtime that comes with Windows, and the cross compiler's would bring.
 *
 * Its C library takes two minutes to compile for each kind of processor, and nothing more of it is used than stands here.
 * Not among the sources of the FMU: compilers on Windows bring theirs.
 */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>

/* Of ucrtbase.dll, behind every printf: lengths and endings as C99 has them. */
#define STANDARD_SNPRINTF 2ULL
int __stdio_common_vsprintf(unsigned long long options, char *text, size_t size, const char *format, void *locale,
                            va_list arguments);

/* Asked for wherever floating-point numbers are. */
int _fltused = 1;

int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved)
{
    (void)library, (void)reason, (void)reserved;
    return 1;
}

int vsnprintf(char *text, size_t size, const char *format, va_list arguments)
{
    return __stdio_common_vsprintf(STANDARD_SNPRINTF, text, size, format, NULL, arguments);
}

/* The compiler makes one call of a sine and a cosine of one angle. Through pointers it does not make this one of it. */
void sincos(double angle, double *sine, double *cosine)
{
    double (*volatile first)(double) = sin, (*volatile second)(double) = cos;
    *sine = first(angle);
    *cosine = second(angle);
}

/* Windows adds pages to a stack one after the other: a large frame touches each of its pages in order, before it uses
 * them. The compiler calls this routine with the size in a register, and wants all the others back as they were; on x86
 * it also moves the stack pointer. */
#if defined(__x86_64__)
__asm__(".globl ___chkstk_ms\n"
        "___chkstk_ms:\n"
        "    pushq %rax\n"
        "    pushq %rcx\n"
        "    leaq 24(%rsp), %rcx\n"
        "1:  cmpq $4096, %rax\n"
        "    jb 2f\n"
        "    subq $4096, %rcx\n"
        "    testl %eax, (%rcx)\n"
        "    subq $4096, %rax\n"
        "    jmp 1b\n"
        "2:  subq %rax, %rcx\n"
        "    testl %eax, (%rcx)\n"
        "    popq %rcx\n"
        "    popq %rax\n"
        "    ret\n");
#elif defined(__i386__)
__asm__(".globl __alloca\n"
        "__alloca:\n"
        "    pushl %ecx\n"
        "    leal 8(%esp), %ecx\n"
        "1:  cmpl $4096, %eax\n"
        "    jb 2f\n"
        "    subl $4096, %ecx\n"
        "    testl %eax, (%ecx)\n"
        "    subl $4096, %eax\n"
        "    jmp 1b\n"
        "2:  subl %eax, %ecx\n"
        "    testl %eax, (%ecx)\n"
        "    movl %esp, %eax\n"
        "    movl %ecx, %esp\n"
        "    movl (%eax), %ecx\n"
        "    jmp *4(%eax)\n");
#elif defined(__aarch64__)
__asm__(".globl __chkstk\n"
        "__chkstk:\n"
        "    lsl x16, x15, #4\n"
        "    mov x17, sp\n"
        "1:  cmp x16, #4096\n"
        "    b.lo 2f\n"
        "    sub x17, x17, #4096\n"
        "    ldr xzr, [x17]\n"
        "    sub x16, x16, #4096\n"
        "    b 1b\n"
        "2:  sub x17, x17, x16\n"
        "    ldr xzr, [x17]\n"
        "    ret\n");
#endif
