"""Arms for language models, by the Model Context Protocol; docs/mcp.md. It needs the extra `mcp`.

async with open_site(Member("sim:", Magician), allow_motion=True) as site:
await serve_stdio(make_server(Works(site)))
"""

from dobot_async.mcp_server.http import serve_http
from dobot_async.mcp_server.server import ArmServer, make_server
from dobot_async.mcp_server.stdio import serve_stdio

__all__ = ["ArmServer", "make_server", "serve_http", "serve_stdio"]
