"""HTTPS: TLS keeps the token secret and the commands authentic, and browsers offer the page their guarded features."""

from __future__ import annotations

import ssl

from backbone.errors import Refusal


class NoCertificate(Refusal):
    """There is no usable certificate."""

    code = "web.certificate"
    remedy = "Give --certificate and --key as PEM files without a password, as your authority or mkcert makes them."


def encryption_with(certificate: str, key: str) -> ssl.SSLContext:
    """Return the TLS context of a server, TLS 1.2 or newer.

    Args:
        certificate: PEM file with the certificate and the intermediate ones.
        key: PEM file with its key; empty: the certificate's file has it too.

    Raises:
        NoCertificate: A file cannot be read, lacks its certificate or key, needs a password, or certificate and key do
            not match.
    """
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key or None, password="")  # otherwise OpenSSL would ask at the terminal
    except OSError as error:  # errors of OpenSSL too
        why = error.strerror or str(error)
        raise NoCertificate(f"cannot serve with {certificate} and {key or 'the key in it'}: {why}") from error
    return context
